// SPDX-License-Identifier: BSD-3-Clause
// Fused L1 + D-SSIM; see ImageLossParams. The image is cut into blocks. Each block computes the
// SSIM moments in itself and 5 pixels around, from inputs up to 10 pixels away, so that no
// intermediate image leaves the cache.
#pragma once

#include <cstddef>

#include "kernels/common/loss.h"
#include "kernels/refit_ops.h"

namespace retint {

// The steps of one block, once in scalar C++ and once in Highway. All planes have rows of
// kLossStride floats; steps may compute up to a vector beyond the width given.
inline constexpr int kLossStride = 160, kLossBlockWidth = 128, kLossBlockHeight = 64;
inline constexpr int kLossRows = kLossBlockHeight + 4 * kSsimRadius;
inline constexpr int kLossPlane = kLossStride * kLossRows + 64;
static_assert(kLossBlockWidth + 4 * kSsimRadius + 12 <= kLossStride);

// Pixels [x0, x1) of a row; the others count for nothing.
struct LossSpan {
  int x0, x1;
};

struct LossKernels {
  // out[3] = the R, G, B planes of `count` interleaved pixels.
  void (*deinterleave)(const float* rgb, int count, float* const* out);
  // moments[5] = window (rows only) * {x, y, x^2, y^2, x y}: `width` values from width + 10.
  void (*moment_rows)(const float* x, const float* y, int width, float* const* moments);
  // out = window * in, horizontally (width values from width + 10).
  void (*blur_row)(const float* in, int width, float* out);
  // out = window * in, vertically: one row from the eleven that start at `in`.
  void (*blur_column)(const float* in, int width, float* out);
  // moments[0..2] of one row are replaced by SSIM's derivatives d_x, d_xx, d_xy, 0 outside `valid`.
  // Returns the sum of 1 - SSIM over `counted`.
  double (*ssim_row)(float* const* moments, int width, LossSpan valid, LossSpan counted);
  // gradient = l1_scale * sign(x - y) + ssim_scale * (back[0] + 2 x back[1] + y back[2]).
  // Returns the sum of |x - y|.
  double (*gradient_row)(const float* x, const float* y, const float* const* back, int width,
                         float l1_scale, float ssim_scale, float* gradient);
  // The reverse of deinterleave.
  void (*interleave)(const float* const* in, int count, float* rgb);
};

const LossKernels& ScalarLossKernels();
const LossKernels& SimdLossKernels();

// The value; params.loss is not looked at, and the region of interest is not empty.
ImageLossValue ImageLossOnCpu(const LossKernels& kernels, const ImageLossParams& params);

}  // namespace retint
