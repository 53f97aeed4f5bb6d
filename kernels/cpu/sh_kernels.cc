// SPDX-License-Identifier: BSD-3-Clause
// Plain C++ on rows of four floats, which Highway has compiled once a target.
#include "kernels/cpu/sh_kernels.h"

#include <algorithm>
#include <cstring>

#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/cpu/sh_kernels.cc"
#include <hwy/foreach_target.h>
// After foreach_target.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace retint {
namespace HWY_NAMESPACE {

using Floats __attribute__((vector_size(16))) = float;

HWY_INLINE Floats Load(const float* from) {
  Floats floats;
  std::memcpy(&floats, from, sizeof(Floats));
  return floats;
}
HWY_INLINE void Store(Floats floats, float* to) { std::memcpy(to, &floats, sizeof(Floats)); }

// Y_k block[k, :], the channels side by side.
HWY_INLINE Floats Dot(const float* basis, const float* block, int k) {
  Floats even{}, odd{};
  int i = 0;
  for (; i + 2 < k; i += 2, block += 6) {  // with the first value of the next one
    even += basis[i] * Load(block);
    odd += basis[i + 1] * Load(block + 3);
  }
  for (; i < k; ++i, block += 3) even += basis[i] * Floats{block[0], block[1], block[2], 0};
  return even + odd;
}

void Eval(const ShGroup<const float>& group, int k, float* colors, int stride) {
  for (int i = 0; i < group.count; ++i) {
    const Floats sum = Dot(group.bases[i], group.blocks[i], k) + 0.5f;
    float* const color = colors + stride * group.entries[i];
    for (int c = 0; c < 3; ++c) color[c] = std::max(0.0f, sum[c]);
  }
}

// block[k, :] += Y_k gradient: four coefficients are three rows of floats.
HWY_INLINE void AddProduct(const float* basis, const float* gradient, int k, float* block) {
  const Floats g = {gradient[0], gradient[1], gradient[2], 0};
  const Floats g0 = __builtin_shufflevector(g, g, 0, 1, 2, 0);
  const Floats g1 = __builtin_shufflevector(g, g, 1, 2, 0, 1);
  const Floats g2 = __builtin_shufflevector(g, g, 2, 0, 1, 2);
  int i = 0;
  for (; i + 4 <= k; i += 4, block += 12) {
    const Floats b = Load(basis + i);
    Store(Load(block) + __builtin_shufflevector(b, b, 0, 0, 0, 1) * g0, block);
    Store(Load(block + 4) + __builtin_shufflevector(b, b, 1, 1, 2, 2) * g1, block + 4);
    Store(Load(block + 8) + __builtin_shufflevector(b, b, 2, 3, 3, 3) * g2, block + 8);
  }
  for (; i < k; ++i, block += 3) {
    for (int c = 0; c < 3; ++c) block[c] += basis[i] * gradient[c];
  }
}

void EvalTranspose(const ShGroup<float>& group, int k, const float* gradients,
                   const float* colors) {
  for (int i = 0; i < group.count; ++i) {
    float gradient[3];
    for (int c = 0; c < 3; ++c) {
      const bool open = !colors || colors[3 * group.entries[i] + c] > 0;
      gradient[c] = open ? gradients[3 * group.entries[i] + c] : 0.0f;
    }
    AddProduct(group.bases[i], gradient, k, group.blocks[i]);
  }
}

void Accumulate(const ShGroup<float>& group, int k, const float* weights) {
  for (int i = 0; i < group.count; ++i) {
    float* block = group.blocks[i];
    for (int row = 0; row < k; ++row) {
      const float* const basis = group.bases[i];
      const float scaled = weights[group.entries[i]] * basis[row];
      int column = 0;
      for (; column + 4 <= row + 1; column += 4, block += 4) {
        Store(Load(block) + scaled * Load(basis + column), block);
      }
      for (; column <= row; ++column) *block++ += scaled * basis[column];
    }
  }
}

const ShKernels* ShKernelsOfTarget() {
  static constexpr ShKernels kKernels = {Eval, EvalTranspose, Accumulate};
  return &kKernels;
}

}  // namespace HWY_NAMESPACE
}  // namespace retint
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace retint {

HWY_EXPORT(ShKernelsOfTarget);

const ShKernels& NativeShKernels() { return *HWY_DYNAMIC_DISPATCH(ShKernelsOfTarget)(); }

}  // namespace retint
#endif
