// SPDX-License-Identifier: BSD-3-Clause
// The loss's steps as the formulas read.
#include <cmath>

#include "kernels/cpu/image_loss.h"

namespace retint {
namespace {

constexpr int kTaps = 2 * kSsimRadius + 1;

void Deinterleave(const float* rgb, int count, float* const* out) {
  for (int i = 0; i < count; ++i) {
    for (int c = 0; c < 3; ++c) out[c][i] = rgb[3 * i + c];
  }
}

void Interleave(const float* const* in, int count, float* rgb) {
  for (int i = 0; i < count; ++i) {
    for (int c = 0; c < 3; ++c) rgb[3 * i + c] = in[c][i];
  }
}

void MomentRows(const float* x, const float* y, int width, float* const* moments) {
  for (int i = 0; i < width; ++i) {
    float sums[5] = {};
    for (int t = 0; t < kTaps; ++t) {
      const float w = kSsimWindow[t], a = x[i + t], b = y[i + t];
      sums[0] += w * a;
      sums[1] += w * b;
      sums[2] += w * (a * a);
      sums[3] += w * (b * b);
      sums[4] += w * (a * b);
    }
    for (int m = 0; m < 5; ++m) moments[m][i] = sums[m];
  }
}

void BlurRow(const float* in, int width, float* out) {
  for (int i = 0; i < width; ++i) {
    float sum = 0;
    for (int t = 0; t < kTaps; ++t) sum += kSsimWindow[t] * in[i + t];
    out[i] = sum;
  }
}

void BlurColumn(const float* in, int width, float* out) {
  for (int i = 0; i < width; ++i) {
    float sum = 0;
    for (int t = 0; t < kTaps; ++t) sum += kSsimWindow[t] * in[t * kLossStride + i];
    out[i] = sum;
  }
}

double SsimRow(float* const* moments, int width, LossSpan valid, LossSpan counted) {
  double sum = 0;
  for (int i = 0; i < width; ++i) {
    SsimPoint<float> point{1, 0, 0, 0};
    if (i >= valid.x0 && i < valid.x1) {
      point =
          Ssim<float>({moments[0][i], moments[1][i], moments[2][i], moments[3][i], moments[4][i]},
                      1.0f, kSsimC1, kSsimC2);
    }
    if (i >= counted.x0 && i < counted.x1) sum += double(1 - point.value);
    moments[0][i] = point.d_x;
    moments[1][i] = point.d_xx;
    moments[2][i] = point.d_xy;
  }
  return sum;
}

double GradientRow(const float* x, const float* y, const float* const* back, int width,
                   float l1_scale, float ssim_scale, float* gradient) {
  double sum = 0;
  for (int i = 0; i < width; ++i) {
    const float difference = x[i] - y[i];
    const float sign = float(difference > 0) - float(difference < 0);
    const float d_ssim = back[0][i] + 2 * x[i] * back[1][i] + y[i] * back[2][i];
    sum += double(std::fabs(difference));
    gradient[i] = l1_scale * sign + ssim_scale * d_ssim;
  }
  return sum;
}

}  // namespace

const LossKernels& ScalarLossKernels() {
  static constexpr LossKernels kKernels = {Deinterleave, MomentRows,  BlurRow,   BlurColumn,
                                           SsimRow,      GradientRow, Interleave};
  return kKernels;
}

}  // namespace retint
