// SPDX-License-Identifier: BSD-3-Clause
// The groups of operations of the CUDA backend on a stream, each made beside its kernels. Their
// operations are public, since nvcc allows no device lambda in a protected member function.
#pragma once

#include <memory>

#include <cuda_runtime.h>

#include "kernels/backend.h"

namespace retint::cuda {

class CudaBlendOps : public BlendOps {
 public:
  // BlendTranspose for a caller that knows a bound: no finite |residual| exceeds *largest, which
  // lies on the device (fixed_sums.cuh).
  virtual void BlendTransposeUpTo(const ViewGeometry& view, const BlendTransposeParams& params,
                                  const float* largest) = 0;
};

std::unique_ptr<CudaBlendOps> MakeBlendOps(cudaStream_t stream);
std::unique_ptr<ShOps> MakeShOps(cudaStream_t stream);
std::unique_ptr<SolveOps> MakeSolveOps(cudaStream_t stream);
std::unique_ptr<RefitOps> MakeRefitOps(cudaStream_t stream, CudaBlendOps& blend);
std::unique_ptr<MaskOps> MakeMaskOps(cudaStream_t stream);
std::unique_ptr<StereoOps> MakeStereoOps(cudaStream_t stream);
std::unique_ptr<NeighborOps> MakeNeighborOps(cudaStream_t stream);
std::unique_ptr<GraphOps> MakeGraphOps(cudaStream_t stream);

}  // namespace retint::cuda
