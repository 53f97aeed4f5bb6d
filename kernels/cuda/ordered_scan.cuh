// SPDX-License-Identifier: BSD-3-Clause
// A sum over all blocks before, within the kernel that makes the values: single-pass scan with
// decoupled look-back (Merrill and Garland 2016).
#pragma once

#include <cstdint>

#include <cub/block/block_scan.cuh>

#include "kernels/cuda/device.cuh"

namespace retint::cuda {

// Words: a ticket, then a word for each block. It holds nothing, the block's own sum, or the sum up
// to its end, in the low 32 bits below a tag.
class ScanState {
 public:
  static size_t Words(unsigned blocks) { return size_t(blocks) + 1; }
  ScanState(unsigned long long* words, unsigned blocks) : words_(words), blocks_(blocks) {}

  // Called with i from 0 to at least the number of blocks, before the kernel that scans.
  __device__ void Clear(int64_t i) const {
    if (i <= blocks_) words_[i] = 0;
  }

  // The blocks' order is that in which they start, so that those waited for run.
  __device__ int NextBlock() const {
    __shared__ int block;
    if (threadIdx.x == 0) block = int(atomicAdd(words_, 1ull));
    __syncthreads();
    return block;
  }

  // Of `value` over all threads up to this one, in the order of the blocks. Every thread calls it,
  // once.
  template <int kBlockThreads>
  __device__ uint32_t InclusiveSum(int block, uint32_t value) const {
    using BlockScan = cub::BlockScan<uint32_t, kBlockThreads>;
    __shared__ typename BlockScan::TempStorage storage;
    __shared__ uint32_t before;
    uint32_t inclusive, sum;
    BlockScan(storage).InclusiveSum(value, inclusive, sum);
    if (threadIdx.x < 32) {
      const uint32_t prefix = SumBefore(block, sum);
      if (threadIdx.x == 0) before = prefix;
    }
    __syncthreads();
    return before + inclusive;
  }

 private:
  static constexpr unsigned long long kOwn = 1ull << 32, kUpToEnd = 2ull << 32;

  __device__ void Publish(int block, unsigned long long word) const {
    *static_cast<volatile unsigned long long*>(words_ + 1 + block) = word;
  }

  // By one whole warp: looks back over 32 blocks at a time.
  __device__ uint32_t SumBefore(int block, uint32_t sum) const {
    const int lane = int(threadIdx.x);
    if (lane == 0) Publish(block, (block == 0 ? kUpToEnd : kOwn) | sum);
    uint32_t prefix = 0;
    for (int last = block - 1; last >= 0; last -= 32) {
      unsigned long long word = kUpToEnd;
      if (last - lane >= 0) {
        do {
          word = *static_cast<const volatile unsigned long long*>(words_ + 1 + last - lane);
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
    if (lane == 0 && block > 0) Publish(block, kUpToEnd | (prefix + sum));
    return prefix;
  }

  unsigned long long* words_;
  int64_t blocks_;
};

}  // namespace retint::cuda
