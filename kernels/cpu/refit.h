// SPDX-License-Identifier: BSD-3-Clause
// The refit's steps on images and regions; see backend.h.
#pragma once

#include "kernels/backend.h"

namespace retint {

void RegionTargetOnCpu(const ViewGeometry& view, const RegionTargetParams& params);
void RegionResidualOnCpu(const ViewGeometry& view, const RegionResidualParams& params);
void RegionWeightImageOnCpu(const ViewGeometry& view, const uint8_t* weights, float* image);
void RegionAddOnCpu(const ViewGeometry& view, float* image, const float* delta);
void PackBoxOnCpu(const PackBoxParams& params);
void UnpackBoxOnCpu(const PackBoxParams& params);
void EditImageOnCpu(const EditImageParams& params);

}  // namespace retint
