// SPDX-License-Identifier: BSD-3-Clause
// The inner loops of ShOps, on a few Gaussians at a time.
#pragma once

#include <cstdint>

#include "kernels/common/types.h"

namespace retint {

// Gaussians that a view sees, each with its basis Y in that direction and its block of coefficients
// or of sums.
template <typename Float>
struct ShGroup {
  static constexpr int kSize = 4;
  int count = 0;  // the others are not looked at
  alignas(16) float bases[kSize][kMaxShCoeffs];
  Float* blocks[kSize];
  int64_t entries[kSize];
};

// Of k coefficients.
struct ShKernels {
  // colors[entry * stride + c] = max(0, 0.5 + sum_k Y_k block[k, c])
  void (*eval)(const ShGroup<const float>& group, int k, float* colors, int stride);
  // block[k, :] += Y_k gradients[entry, :], of the channels whose color, where `colors` is not
  // null, is above 0.
  void (*eval_transpose)(const ShGroup<float>& group, int k, const float* gradients,
                         const float* colors);
  // block += weights[entry] Y Y^T, the lower triangle row by row.
  void (*accumulate)(const ShGroup<float>& group, int k, const float* weights);
};

// Compiled for the processor's instructions, chosen at run time.
const ShKernels& NativeShKernels();

}  // namespace retint
