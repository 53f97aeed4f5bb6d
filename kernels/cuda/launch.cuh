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

// body(i) for i in [0, count), one thread each; error messages have `name`.
template <typename Body>
void ForEach(int64_t count, cudaStream_t stream, const char* name, const Body& body) {
  constexpr int kThreads = 256;
  if (count <= 0) return;
  ElementsKernel<<<Blocks(count, kThreads), kThreads, 0, stream>>>(count, body);
  Check(cudaGetLastError(), name);
}

// The sum of `value` over the block (any number of whole warps), for its first thread.
__device__ inline double SumOverBlock(double value) {
  __shared__ double partial[32];
  const int lane = threadIdx.x % 32, warp = threadIdx.x / 32;
  __syncthreads();
  for (int offset = 16; offset > 0; offset /= 2)
    value += __shfl_down_sync(kFullWarp, value, offset);
  if (lane == 0) partial[warp] = value;
  __syncthreads();
  double sum = 0;
  if (threadIdx.x == 0) {
    for (int w = 0; w < int(blockDim.x + 31) / 32; ++w) sum += partial[w];
  }
  return sum;
}

// A sum over all blocks of a kernel, equal to the last bit however they were scheduled. Every block
// stores its part, and the last one to finish adds the parts in order.
struct BlockSums {
  double* parts;       // [blocks]
  unsigned* finished;  // [1] zero between kernels

  // Adds the sum of `value` over all threads of the grid to *total. Every thread calls it, once.
  __device__ void AddTo(double* total, double value) const {
    __shared__ bool is_last;
    const unsigned block = blockIdx.x + gridDim.x * (blockIdx.y + gridDim.y * blockIdx.z);
    const unsigned blocks = gridDim.x * gridDim.y * gridDim.z;
    const double of_block = SumOverBlock(value);
    if (threadIdx.x == 0) {
      parts[block] = of_block;
      __threadfence();
      is_last = atomicAdd(finished, 1u) + 1 == blocks;
    }
    __syncthreads();
    if (!is_last) return;
    __threadfence();
    double sum = 0;
    for (unsigned i = threadIdx.x; i < blocks; i += blockDim.x) sum += __ldcg(parts + i);
    sum = SumOverBlock(sum);
    if (threadIdx.x > 0) return;
    *total += sum;
    *finished = 0;
  }
};

// The memory of kernels that sum and follow one another on a stream. Taking it and starting the
// kernel is one step: whoever calls from several threads locks around both.
class BlockSumsMemory {
 public:
  BlockSums Take(size_t blocks, cudaStream_t stream) {
    if (finished_.size() == 0) {
      finished_ = Scratch<unsigned>(stream, 1);
      Check(cudaMemsetAsync(finished_.data(), 0, finished_.bytes(), stream), "cudaMemsetAsync");
    }
    if (parts_.size() < blocks) parts_ = Scratch<double>(stream, blocks);
    return {parts_.data(), finished_.data()};
  }

 private:
  Scratch<double> parts_;
  Scratch<unsigned> finished_;
};

}  // namespace retint::cuda
