// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <stdexcept>
#include <type_traits>

#include "kernels/cuda/geometry.cuh"

namespace retint::cuda {

void Blend(const CudaViewGeometry& view, BlendParams params, cudaStream_t stream);
void BlendTranspose(const CudaViewGeometry& view, const BlendTransposeParams& params,
                    cudaStream_t stream);
void Depth(const CudaViewGeometry& view, const DepthParams& params, cudaStream_t stream);

}  // namespace retint::cuda
