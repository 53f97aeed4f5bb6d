// SPDX-License-Identifier: BSD-3-Clause
// Blending on the device: the tile loops behind BlendOps, without CudaBlendOps's own buffers.
#pragma once

#include <stdexcept>
#include <type_traits>

#include "kernels/cuda/fixed_sums.cuh"
#include "kernels/cuda/geometry.cuh"

namespace retint::cuda {

void Blend(const CudaViewGeometry& view, BlendParams params, cudaStream_t stream);
void BlendShares(const CudaViewGeometry& view, const BlendSharesParams& params,
                 cudaStream_t stream);
// The largest |params.residual| that BlendTranspose reads, into *largest.
void LargestOf(const CudaViewGeometry& view, const BlendTransposeParams& params, float* largest,
               cudaStream_t stream);
// Adds the result of BlendOps::BlendTranspose to `sums`, [rows, C], instead of params.result.
void BlendTranspose(const CudaViewGeometry& view, const BlendTransposeParams& params,
                    const FixedSums& sums, cudaStream_t stream);
void Depth(const CudaViewGeometry& view, const DepthParams& params, cudaStream_t stream);

}  // namespace retint::cuda
