// SPDX-License-Identifier: BSD-3-Clause
// The mask projection's steps; see backend.h.
#pragma once

#include "kernels/backend.h"

namespace retint {

void SampleDepthOnCpu(const SampleDepthParams& params);
void CorrectDepthOnCpu(const CorrectDepthParams& params);
void DrawCloudOnCpu(const DrawCloudParams& params);
void MakeMaskOnCpu(const MakeMaskParams& params);
void MarkSilhouetteOnCpu(const MarkSilhouetteParams& params);
void EvidenceOnCpu(const EvidenceParams& params);
void GatherRowsOnCpu(const ViewGeometry& view, const float* of, int32_t channels, float* values);
void AddRowsOnCpu(const ViewGeometry& view, const float* values, int32_t channels, float* sums);

}  // namespace retint
