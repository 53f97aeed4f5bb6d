// SPDX-License-Identifier: BSD-3-Clause
// A sum over all blocks before, within the kernel that makes the values: single-pass scan with
// decoupled look-back (Merrill and Garland 2016). Blocks start in the order of their numbers, as
// CUB's scan assumes too, so that those waited for run.
#pragma once

#include <cstdint>

#include <cub/block/block_scan.cuh>

#include "kernels/cuda/device.cuh"

namespace retint::cuda {

// A word for each block: it holds nothing, the block's own sum, or the sum up to its end, in the
// low 32 bits below a tag.
class ScanState {
 public:
  // The words are zero before the kernel that scans.
  explicit ScanState(unsigned long long* words) : words_(words) {}

  // Of `value` over all threads up to this one, in the order of the blocks. Every thread calls it,
  // once.
  template <int kBlockThreads>
  __device__ uint32_t InclusiveSum(uint32_t value) const {
    using BlockScan = cub::BlockScan<uint32_t, kBlockThreads>;
    __shared__ typename BlockScan::TempStorage storage;
    __shared__ uint32_t before;
    uint32_t inclusive, sum;
    BlockScan(storage).InclusiveSum(value, inclusive, sum);
    if (threadIdx.x < 32) {
      const uint32_t prefix = SumBefore(sum);
      if (threadIdx.x == 0) before = prefix;
    }
    __syncthreads();
    return before + inclusive;
  }

 private:
  static constexpr unsigned long long kOwn = 1ull << 32, kUpToEnd = 2ull << 32;

  __device__ void Publish(unsigned long long word) const {
    *static_cast<volatile unsigned long long*>(words_ + blockIdx.x) = word;
  }

  // By one whole warp: looks back over 32 blocks at a time.
  __device__ uint32_t SumBefore(uint32_t sum) const {
    const int lane = int(threadIdx.x), block = int(blockIdx.x);
    if (lane == 0) Publish((block == 0 ? kUpToEnd : kOwn) | sum);
    uint32_t prefix = 0;
    for (int last = block - 1; last >= 0; last -= 32) {
      unsigned long long word = kUpToEnd;
      if (last - lane >= 0) {
        do {
          word = *static_cast<const volatile unsigned long long*>(words_ + last - lane);
        } while (!(word >> 32));
      }
      const unsigned ends = __ballot_sync(kFullWarp, word >= kUpToEnd);
      const int nearest = ends ? __ffs(ends) - 1 : 31;
      uint32_t part = lane <= nearest ? uint32_t(word) : 0;
      for (int offset = 16; offset > 0; offset /= 2) {
        part += __shfl_xor_sync(kFullWarp, part, offset);
      }
      prefix += part;
      if (ends) break;
    }
    if (lane == 0 && block > 0) Publish(kUpToEnd | (prefix + sum));
    return prefix;
  }

  unsigned long long* words_;
};

}  // namespace retint::cuda
