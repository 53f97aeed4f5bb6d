// SPDX-License-Identifier: BSD-3-Clause
// Elementwise launches.
#pragma once

#include "kernels/cuda/device.cuh"

namespace retint::cuda {

template <typename Body>
__global__ void ElementsKernel(int64_t count, Body body) {
  const int64_t i = int64_t(blockIdx.x) * blockDim.x + threadIdx.x;
  if (i < count) body(i);
}

// body(i) for i in [0, count), a thread each; `name` is what an error speaks of.
template <typename Body>
void ForEach(int64_t count, cudaStream_t stream, const char* name, const Body& body) {
  constexpr int kThreads = 256;
  if (count <= 0) return;
  ElementsKernel<<<Blocks(count, kThreads), kThreads, 0, stream>>>(count, body);
  Check(cudaGetLastError(), name);
}

// Sums `value` over the block (any number of whole warps) into *total, once.
__device__ inline void AddOverBlock(double value, double* total) {
  __shared__ double partial[32];
  const int lane = threadIdx.x % 32, warp = threadIdx.x / 32;
  __syncthreads();
  for (int offset = 16; offset > 0; offset /= 2)
    value += __shfl_down_sync(kFullWarp, value, offset);
  if (lane == 0) partial[warp] = value;
  __syncthreads();
  if (threadIdx.x == 0) {
    double sum = 0;
    for (int w = 0; w < int(blockDim.x + 31) / 32; ++w) sum += partial[w];
    atomicAdd(total, sum);
  }
}

}  // namespace retint::cuda
