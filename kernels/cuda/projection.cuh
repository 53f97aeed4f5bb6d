// SPDX-License-Identifier: BSD-3-Clause
// The mask projection's steps of kernels/backend.h, on a stream.
#pragma once

#include "kernels/cuda/geometry.cuh"

namespace retint::cuda {

void SampleDepth(const SampleDepthParams& params, cudaStream_t stream);
void CorrectDepth(const CorrectDepthParams& params, cudaStream_t stream);
void DrawCloud(const DrawCloudParams& params, cudaStream_t stream);
void MakeMask(const MakeMaskParams& params, cudaStream_t stream);
void MarkSilhouette(const MarkSilhouetteParams& params, cudaStream_t stream);
void Evidence(const EvidenceParams& params, cudaStream_t stream);
void GatherRows(const CudaViewGeometry& view, const float* of, int32_t channels, float* values,
                cudaStream_t stream);
void AddRows(const CudaViewGeometry& view, const float* values, int32_t channels, float* sums,
             cudaStream_t stream);

}  // namespace retint::cuda
