// SPDX-License-Identifier: BSD-3-Clause
// Sums of terms that arrive in any order and are still equal to the last bit. The terms are rounded
// to multiples of a power of two, the step, and added as 64-bit integers. The step follows the
// largest factor of the terms, so that no sum overflows. It is some 2^-40 times that factor, far
// less than the rounding of a float sum. A term that is not finite makes only its own sum NaN, and
// no other one.
#pragma once

#include <bit>
#include <cmath>

#include "kernels/cuda/launch.cuh"

namespace retint::cuda {

// By the bits, since sources may be compiled with fast maths.
__device__ inline bool IsFinite(float value) {
  return (__float_as_uint(value) & 0x7f800000u) != 0x7f800000u;
}

// The larger of `largest` and |value|, where that is finite.
__device__ inline float LargerMagnitude(float largest, float value) {
  return IsFinite(value) ? fmaxf(largest, fabsf(value)) : largest;
}

// Raises *largest to the largest `value` of the warp's lanes, all of which call it. Bits of floats
// that are not negative order as integers do.
__device__ inline void RaiseLargest(float value, float* largest) {
  int bits = __float_as_int(value);
  for (int offset = 16; offset > 0; offset /= 2) {
    bits = max(bits, __shfl_xor_sync(kFullWarp, bits, offset));
  }
  int* const to = reinterpret_cast<int*>(largest);
  if (threadIdx.x % 32 == 0 && bits > *static_cast<volatile int*>(to)) atomicMax(to, bits);
}

struct FixedSums {
  unsigned long long* sums;  // [rows, C], zero between uses; two's complement
  const float* largest;      // [1] at least every finite factor's absolute value
  int headroom;              // no sum is more than 2^headroom of the largest factor

  // Sums lie below 2^61. If a term is not finite, its sum starts again from here, so that it ends
  // within 2^61 of this value.
  static constexpr long long kNoNumber = 1ll << 62;

  struct Steps {
    float per_unit, unit;
  };
  __device__ Steps Load() const {
    const int biased = __float_as_int(*largest) >> 23;  // *largest < 2^(biased - 126)
    const int exponent = min(61 - headroom - (biased - 126), 120);
    return {__int_as_float((127 + exponent) << 23), __int_as_float((127 - exponent) << 23)};
  }

  // Adds sum_of(c) to the C sums of `row`. A lane without a row passes a negative one. kHolders
  // lanes side by side have the same row and sums, and divide the channels among them. All lanes of
  // the warp must call it.
  template <int C, int kHolders, typename SumOf>
  __device__ void Add(float per_unit, int64_t row, const SumOf& sum_of) const {
    constexpr int kPieces = (C + kHolders - 1) / kHolders;
    const int holder = threadIdx.x % kHolders;
    float mine[kPieces] = {};
#pragma unroll
    for (int c = 0; c < C; ++c) {
      const float sum = sum_of(c);
      if (holder == c % kHolders) mine[c / kHolders] = sum;
    }
#pragma unroll
    for (int piece = 0; piece < kPieces; ++piece) {
      const int c = piece * kHolders + holder;
      if (c >= C || row < 0 || mine[piece] == 0) continue;
      unsigned long long* const sum = sums + row * C + c;
      if (IsFinite(mine[piece])) {
        const long long steps = __float2ll_rn(mine[piece] * per_unit);
        atomicAdd(sum, static_cast<unsigned long long>(steps));
      } else {
        atomicExch(sum, static_cast<unsigned long long>(kNoNumber));
      }
    }
  }
};

// The memory of sums that follow one another on a stream.
class FixedSumsMemory {
 public:
  // For sums over at most `terms` factors, each weighted by at most 1 (and its rounding).
  FixedSums Take(size_t count, int64_t terms, const float* largest, cudaStream_t stream) {
    if (sums_.size() < count) {
      sums_ = Scratch<unsigned long long>();  // free before taking the larger one
      sums_ = Scratch<unsigned long long>(stream, count);
      Check(cudaMemsetAsync(sums_.data(), 0, sums_.bytes(), stream), "cudaMemsetAsync");
    }
    return {sums_.data(), largest, int(std::bit_width(uint64_t(terms))) + 1};
  }

 private:
  Scratch<unsigned long long> sums_;
};

// result = sums, which are zero again afterwards.
inline void MoveSums(const FixedSums& from, int64_t count, float* result, cudaStream_t stream) {
  ForEach(count, stream, "MoveSums", [=] __device__(int64_t i) {
    const FixedSums::Steps steps = from.Load();
    const auto sum = static_cast<long long>(from.sums[i]);
    from.sums[i] = 0;
    result[i] = sum < FixedSums::kNoNumber / 2 ? __ll2float_rn(sum) * steps.unit : NAN;
  });
}

}  // namespace retint::cuda
