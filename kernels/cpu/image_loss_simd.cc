// SPDX-License-Identifier: BSD-3-Clause
// The loss's steps in Highway, compiled once a target and chosen at run time.
#include <cstddef>

#include "kernels/cpu/image_loss.h"

#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/cpu/image_loss_simd.cc"
#include <hwy/foreach_target.h>
// After foreach_target.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace retint {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Rows are padded for vectors of up to this many lanes.
using Tag = hn::CappedTag<float, 16>;
using V = hn::Vec<Tag>;
constexpr int kTaps = 2 * kSsimRadius + 1;

HWY_INLINE int Lanes() { return int(hn::Lanes(Tag())); }

void Deinterleave(const float* rgb, int count, float* const* out) {
  const Tag d;
  int i = 0;
  for (; i + Lanes() <= count; i += Lanes()) {
    V r, g, b;
    hn::LoadInterleaved3(d, rgb + 3 * i, r, g, b);
    hn::StoreU(r, d, out[0] + i);
    hn::StoreU(g, d, out[1] + i);
    hn::StoreU(b, d, out[2] + i);
  }
  for (; i < count; ++i) {
    for (int c = 0; c < 3; ++c) out[c][i] = rgb[3 * i + c];
  }
}

void Interleave(const float* const* in, int count, float* rgb) {
  const Tag d;
  int i = 0;
  for (; i + Lanes() <= count; i += Lanes()) {
    hn::StoreInterleaved3(hn::LoadU(d, in[0] + i), hn::LoadU(d, in[1] + i), hn::LoadU(d, in[2] + i),
                          d, rgb + 3 * i);
  }
  for (; i < count; ++i) {
    for (int c = 0; c < 3; ++c) rgb[3 * i + c] = in[c][i];
  }
}

void MomentRows(const float* x, const float* y, int width, float* const* moments) {
  const Tag d;
  for (int i = 0; i < width; i += Lanes()) {
    V sums[5];
    for (V& sum : sums) sum = hn::Zero(d);
    for (int t = 0; t < kTaps; ++t) {
      const V w = hn::Set(d, kSsimWindow[t]);
      const V a = hn::LoadU(d, x + i + t), b = hn::LoadU(d, y + i + t);
      const V wa = hn::Mul(w, a), wb = hn::Mul(w, b);
      sums[0] = hn::Add(sums[0], wa);
      sums[1] = hn::Add(sums[1], wb);
      sums[2] = hn::MulAdd(wa, a, sums[2]);
      sums[3] = hn::MulAdd(wb, b, sums[3]);
      sums[4] = hn::MulAdd(wa, b, sums[4]);
    }
    for (int m = 0; m < 5; ++m) hn::StoreU(sums[m], d, moments[m] + i);
  }
}

HWY_INLINE void Blur(const float* in, int step, int width, float* out) {
  const Tag d;
  for (int i = 0; i < width; i += Lanes()) {
    // Two sums, for the latency of one would count.
    V even = hn::Zero(d), odd = hn::Zero(d);
    for (int t = 0; t < kTaps; ++t) {
      V& sum = t % 2 == 0 ? even : odd;
      sum = hn::MulAdd(hn::Set(d, kSsimWindow[t]), hn::LoadU(d, in + t * step + i), sum);
    }
    hn::StoreU(hn::Add(even, odd), d, out + i);
  }
}

void BlurRow(const float* in, int width, float* out) { Blur(in, 1, width, out); }
void BlurColumn(const float* in, int width, float* out) { Blur(in, kLossStride, width, out); }

// Lanes whose index i + lane lies in the span.
HWY_INLINE hn::Mask<Tag> InSpan(int i, LossSpan span) {
  const Tag d;
  const V index = hn::Iota(d, float(i));
  return hn::And(hn::Ge(index, hn::Set(d, float(span.x0))),
                 hn::Lt(index, hn::Set(d, float(span.x1))));
}

// Ssim() of common/loss.h, which cannot carry this target's attributes.
double SsimRow(float* const* moments, int width, LossSpan valid, LossSpan counted) {
  const Tag d;
  const V one = hn::Set(d, 1.0f), two = hn::Set(d, 2.0f);
  const V c1 = hn::Set(d, kSsimC1), c2 = hn::Set(d, kSsimC2);
  V sum = hn::Zero(d);
  for (int i = 0; i < width; i += Lanes()) {
    const V mx = hn::LoadU(d, moments[0] + i), my = hn::LoadU(d, moments[1] + i);
    const V exx = hn::LoadU(d, moments[2] + i), eyy = hn::LoadU(d, moments[3] + i);
    const V exy = hn::LoadU(d, moments[4] + i);
    const V mxy = hn::Mul(mx, my), mm = hn::MulAdd(mx, mx, hn::Mul(my, my));
    const V a1 = hn::MulAdd(two, mxy, c1), a2 = hn::MulAdd(two, hn::Sub(exy, mxy), c2);
    const V b1 = hn::Add(mm, c1), b2 = hn::Add(hn::Sub(hn::Add(exx, eyy), mm), c2);
    const V inverse_b1 = hn::Div(one, b1), inverse_b2 = hn::Div(one, b2);
    const V inverse = hn::Mul(inverse_b1, inverse_b2);
    const V value = hn::Mul(hn::Mul(a1, a2), inverse);
    const V d_xx = hn::Neg(hn::Mul(value, inverse_b2));
    const V d_xy = hn::Mul(hn::Mul(two, a1), inverse);
    const V direct =
        hn::Sub(hn::Mul(hn::Mul(my, a2), inverse), hn::Mul(hn::Mul(mx, value), inverse_b1));
    const V d_x = hn::NegMulAdd(my, d_xy, hn::Mul(two, hn::NegMulAdd(mx, d_xx, direct)));
    const auto inside = InSpan(i, valid);
    hn::StoreU(hn::IfThenElseZero(inside, d_x), d, moments[0] + i);
    hn::StoreU(hn::IfThenElseZero(inside, d_xx), d, moments[1] + i);
    hn::StoreU(hn::IfThenElseZero(inside, d_xy), d, moments[2] + i);
    sum =
        hn::Add(sum, hn::IfThenElseZero(hn::And(inside, InSpan(i, counted)), hn::Sub(one, value)));
  }
  return double(hn::GetLane(hn::SumOfLanes(d, sum)));
}

double GradientRow(const float* x, const float* y, const float* const* back, int width,
                   float l1_scale, float ssim_scale, float* gradient) {
  const Tag d;
  const V zero = hn::Zero(d), scale = hn::Set(d, l1_scale), two = hn::Set(d, 2.0f);
  V sum = zero;
  for (int i = 0; i < width; i += Lanes()) {
    const V vx = hn::LoadU(d, x + i), vy = hn::LoadU(d, y + i);
    const V difference = hn::Sub(vx, vy);
    const V step = hn::IfThenElse(hn::Gt(difference, zero), scale,
                                  hn::IfThenElseZero(hn::Lt(difference, zero), hn::Neg(scale)));
    V d_ssim = hn::MulAdd(hn::Mul(two, vx), hn::LoadU(d, back[1] + i), hn::LoadU(d, back[0] + i));
    d_ssim = hn::MulAdd(vy, hn::LoadU(d, back[2] + i), d_ssim);
    hn::StoreU(hn::MulAdd(hn::Set(d, ssim_scale), d_ssim, step), d, gradient + i);
    sum = hn::Add(sum, hn::IfThenElseZero(InSpan(i, {0, width}), hn::Abs(difference)));
  }
  return double(hn::GetLane(hn::SumOfLanes(d, sum)));
}

const LossKernels* LossKernelsOfTarget() {
  static constexpr LossKernels kKernels = {Deinterleave, MomentRows,  BlurRow,   BlurColumn,
                                           SsimRow,      GradientRow, Interleave};
  return &kKernels;
}

}  // namespace HWY_NAMESPACE
}  // namespace retint
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace retint {

HWY_EXPORT(LossKernelsOfTarget);

const LossKernels& SimdLossKernels() { return *HWY_DYNAMIC_DISPATCH(LossKernelsOfTarget)(); }

}  // namespace retint
#endif
