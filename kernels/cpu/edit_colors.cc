// SPDX-License-Identifier: BSD-3-Clause
// The formulas of color edits on a vector of colors, compiled once a target and chosen at run time.
#include "kernels/edit_colors.h"

#include <cstddef>

#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/cpu/edit_colors.cc"
#include <hwy/foreach_target.h>
// After foreach_target.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace retint {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Tag = hn::CappedTag<float, 16>;
constexpr size_t kLanes = hn::MaxLanes(Tag());

// The vector types that stand for bool and float in the formulas.
struct Truth {
  hn::Mask<Tag> is;
};
struct Real {
  hn::Vec<Tag> x;
  Real() = default;
  HWY_INLINE Real(float value) : x(hn::Set(Tag(), value)) {}
  HWY_INLINE explicit Real(hn::Vec<Tag> value) : x(value) {}
};

HWY_INLINE Truth operator&(Truth a, Truth b) { return {hn::And(a.is, b.is)}; }
HWY_INLINE Truth operator!(Truth a) { return {hn::Not(a.is)}; }
HWY_INLINE bool Any(Truth a) { return !hn::AllFalse(Tag(), a.is); }
HWY_INLINE Truth operator<(Real a, Real b) { return {hn::Lt(a.x, b.x)}; }
HWY_INLINE Truth operator>(Real a, Real b) { return {hn::Gt(a.x, b.x)}; }
HWY_INLINE Truth operator<=(Real a, Real b) { return {hn::Le(a.x, b.x)}; }
HWY_INLINE Truth operator>=(Real a, Real b) { return {hn::Ge(a.x, b.x)}; }
HWY_INLINE Real Select(Truth condition, Real yes, Real no) {
  return Real(hn::IfThenElse(condition.is, yes.x, no.x));
}

HWY_INLINE Real operator+(Real a, Real b) { return Real(hn::Add(a.x, b.x)); }
HWY_INLINE Real operator-(Real a, Real b) { return Real(hn::Sub(a.x, b.x)); }
HWY_INLINE Real operator-(Real a) { return Real(hn::Neg(a.x)); }
HWY_INLINE Real operator*(Real a, Real b) { return Real(hn::Mul(a.x, b.x)); }
HWY_INLINE Real operator/(Real a, Real b) { return Real(hn::Div(a.x, b.x)); }
HWY_INLINE Real& operator+=(Real& a, Real b) { return a = a + b; }
HWY_INLINE Real& operator-=(Real& a, Real b) { return a = a - b; }
HWY_INLINE Real& operator*=(Real& a, Real b) { return a = a * b; }

HWY_INLINE Real fabsf(Real a) { return Real(hn::Abs(a.x)); }
HWY_INLINE Real fminf(Real a, Real b) { return Real(hn::Min(a.x, b.x)); }
HWY_INLINE Real fmaxf(Real a, Real b) { return Real(hn::Max(a.x, b.x)); }
HWY_INLINE Real sqrtf(Real a) { return Real(hn::Sqrt(a.x)); }
HWY_INLINE Real floorf(Real a) { return Real(hn::Floor(a.x)); }
HWY_INLINE Real copysignf(Real a, Real sign) { return Real(hn::CopySign(a.x, sign.x)); }

// sum of coefficients[i] x^(N - 1 - i)
template <size_t N>
HWY_INLINE Real Polynomial(const float (&coefficients)[N], Real x) {
  Real sum = coefficients[0];
  for (size_t i = 1; i < N; ++i) {
    sum.x = hn::MulAdd(sum.x, x.x, hn::Set(Tag(), coefficients[i]));
  }
  return sum;
}

// Of a normal number above 0: its exponent plus the logarithm of its mantissa m in [sqrt(1/2),
// sqrt(2)], as a series of (m - 1) / (m + 1).
HWY_INLINE Real Log2(Real a) {
  const Tag d;
  const hn::RebindToSigned<Tag> di;
  constexpr int32_t kSqrtHalf = 0x3f3504f3;
  const auto bits = hn::BitCast(di, a.x);
  const auto exponent = hn::ShiftRight<23>(hn::Sub(bits, hn::Set(di, kSqrtHalf)));
  const Real m(hn::BitCast(d, hn::Sub(bits, hn::ShiftLeft<23>(exponent))));
  const Real s = (m - 1) / (m + 1);
  // 2 / ln 2 over the odd numbers
  constexpr float kSeries[] = {0.320598898f, 0.412198583f, 0.577078016f, 0.961796694f,
                               2.885390082f};
  return Real(hn::MulAdd(s.x, Polynomial(kSeries, s * s).x, hn::ConvertTo(d, exponent)));
}

// Cephes' exp2f: a polynomial of the fraction, in [-1/2, 1/2], and the rest into the exponent.
HWY_INLINE Real Exp2(Real a) {
  const Tag d;
  const hn::RebindToSigned<Tag> di;
  a = fminf(fmaxf(a, -126), 127);
  const auto whole = hn::NearestInt(a.x);
  const Real fraction = a - Real(hn::ConvertTo(d, whole));
  constexpr float kSeries[] = {1.535336188319500e-4f,
                               1.339887440266574e-3f,
                               9.618437357674640e-3f,
                               5.550332471162809e-2f,
                               2.402264791363012e-1f,
                               6.931472028550421e-1f,
                               1.0f};
  const auto mantissa = hn::BitCast(di, Polynomial(kSeries, fraction).x);
  return Real(hn::BitCast(d, hn::Add(mantissa, hn::ShiftLeft<23>(whole))));
}

// Of a base that is not below 0.
HWY_INLINE Real powf(Real base, float exponent) {
  constexpr float kLeast = 1.2e-38f;  // normal
  return Select(base >= kLeast, Exp2(exponent * Log2(fmaxf(base, kLeast))), 0);
}

HWY_INLINE Real cbrtf(Real a) { return copysignf(powf(fabsf(a), 1.0f / 3), a); }

// Abramowitz and Stegun, 4.4.49: an error below 2e-8 for tangents up to 1.
HWY_INLINE Real atan2f(Real y, Real x) {
  constexpr float kPi = 3.14159265359f;
  constexpr float kSeries[] = {0.0028662257f,  -0.0161657367f, 0.0429096138f,
                               -0.0752896400f, 0.1065626393f,  -0.1420889944f,
                               0.1999355085f,  -0.3333314528f, 1.0f};
  const Real across = fabsf(x), up = fabsf(y);
  const Real tangent = fminf(across, up) / fmaxf(fmaxf(across, up), 1e-30f);
  Real angle = tangent * Polynomial(kSeries, tangent * tangent);
  angle = Select(up > across, kPi / 2 - angle, angle);
  angle = Select(x < 0, kPi - angle, angle);
  return copysignf(angle, y);
}

// Tables are looked up one color after the other.
template <class Look>
HWY_INLINE void OneByOne(Real* color, const Look& look) {
  const Tag d;
  HWY_ALIGN float planes[3][kLanes];
  for (int c = 0; c < 3; ++c) hn::Store(color[c].x, d, planes[c]);
  for (size_t i = 0; i < kLanes; ++i) {
    float one[3] = {planes[0][i], planes[1][i], planes[2][i]};
    look(one);
    for (int c = 0; c < 3; ++c) planes[c][i] = one[c];
  }
  for (int c = 0; c < 3; ++c) color[c].x = hn::Load(d, planes[c]);
}
HWY_INLINE void GradientAt(const float* table, int size, Real lightness, Real* color) {
  color[0] = lightness;
  OneByOne(color, [&](float* one) { retint::GradientAt(table, size, one[0], one); });
}
HWY_INLINE void TableColor(const float* table, int size, Real* color) {
  OneByOne(color, [&](float* one) { retint::TableColor(table, size, one); });
}
HWY_INLINE void CurveColor(const float* curve, int size, Real* color) {
  OneByOne(color, [&](float* one) { retint::CurveColor(curve, size, one); });
}
HWY_INLINE void InverseCurveColor(const float* curve, int size, Real* color) {
  OneByOne(color, [&](float* one) { retint::InverseCurveColor(curve, size, one); });
}

#include "kernels/common/color_spaces-inl.h"

#include "kernels/common/color_ops-inl.h"

void EditColorsOfTarget(const ColorMap& map, const uint8_t* mask, const float* colors,
                        int64_t count, float* edited) {
  const Tag d;
  const hn::Rebind<uint8_t, Tag> d8;
  const hn::RebindToSigned<Tag> di;
  HWY_ALIGN float last[3 * kLanes] = {};
  HWY_ALIGN uint8_t last_mask[kLanes] = {};
  for (int64_t i = 0; i < count; i += int64_t(kLanes)) {
    const float* from = colors + 3 * i;
    float* to = edited + 3 * i;
    const uint8_t* shares = mask ? mask + i : nullptr;
    const size_t left = size_t(count - i);
    if (left < kLanes) {
      for (size_t j = 0; j < 3 * left; ++j) last[j] = from[j];
      for (size_t j = 0; shares && j < left; ++j) last_mask[j] = shares[j];
      from = to = last;
      if (shares) shares = last_mask;
    }
    Real color[3], share = 1;
    hn::LoadInterleaved3(d, from, color[0].x, color[1].x, color[2].x);
    if (shares) {
      const Real steps(hn::ConvertTo(d, hn::PromoteTo(di, hn::LoadU(d8, shares))));
      share = steps * (1.0f / 255);
    }
    ApplyColorMap(map, share, color, color);
    hn::StoreInterleaved3(color[0].x, color[1].x, color[2].x, d, to);
    for (size_t j = 0; to == last && j < 3 * left; ++j) edited[3 * i + int64_t(j)] = last[j];
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace retint
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace retint {

HWY_EXPORT(EditColorsOfTarget);

void EditColors(const ColorMap& map, const uint8_t* mask, const float* colors, int64_t count,
                float* edited) {
  HWY_DYNAMIC_DISPATCH(EditColorsOfTarget)(map, mask, colors, count, edited);
}

void EditColorsOneByOne(const ColorMap& map, const uint8_t* mask, const float* colors,
                        int64_t count, float* edited) {
  for (int64_t i = 0; i < count; ++i) {
    ApplyColorMap(map, mask ? mask[i] : uint8_t{255}, colors + 3 * i, edited + 3 * i);
  }
}

}  // namespace retint
#endif
