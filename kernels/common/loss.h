// SPDX-License-Identifier: BSD-3-Clause
// The refit's losses: L1 + D-SSIM, value and closed-form derivative at one pixel (Wang et al. 2004;
// Zhao et al. 2017).
#pragma once

#include <cmath>
#include <cstdint>

#include "kernels/common/macros.h"

namespace retint {

// The weight of a pixel in the refit, in steps of 1 / 255: a mean of `inside` and `outside` by the
// mask.
RETINT_HD uint8_t PixelWeight(uint8_t mask, float inside, float outside) {
  const double share = double(mask) / 255;
  return uint8_t(255 * (share * double(inside) + (1 - share) * double(outside)) + 0.5);
}

// The cost of a change r in a pixel that must not change, one channel: r^2 + 2 slope (sqrt(r^2 +
// bend^2) - bend). The second term grows with the size of a change, so that many changes smaller
// than a step of 8 bits also cost something (Charbonnier et al. 1994). `slope` 0: only the square.
// A pixel must not change if its target is 0 in all channels.
struct StayLoss {
  float slope = 0, bend = 1.0f / 255;  // bend above 0
};

// A residual's cost, and the factor of the residual in half the cost's slope.
struct ResidualCost {
  float value, curvature;
};

// `slope`: of the pixel, see StayLoss; 0 if the pixel may change.
RETINT_HD ResidualCost CostOf(float r, float slope, float bend) {
  const float root = std::sqrt(r * r + bend * bend);
  return {r * r + 2 * slope * (root - bend), 1 + slope / root};
}

RETINT_HD float SlopeAt(const StayLoss& stay, const int16_t* target) {
  return target[0] == 0 && target[1] == 0 && target[2] == 0 ? stay.slope : 0.0f;
}

inline constexpr int kSsimRadius = 5;  // 11 taps
inline constexpr float kSsimC1 = 0.01f * 0.01f;
inline constexpr float kSsimC2 = 0.03f * 0.03f;

// Normalised Gaussian of sigma 1.5 at offsets -5..5: exp(-i^2 / 4.5) / sum.
inline constexpr float kSsimWindow[2 * kSsimRadius + 1] = {
    0.00102838008f, 0.00759875813f, 0.0360007721f, 0.109360689f,   0.213005537f,  0.266011724f,
    0.213005537f,   0.109360689f,   0.0360007721f, 0.00759875813f, 0.00102838008f};

// Local moments under the window: means of x, y, x^2, y^2, x y.
template <typename T>
struct SsimMoments {
  T x, y, xx, yy, xy;
};

// SSIM and its derivatives with respect to the moments that depend on x.
template <typename T>
struct SsimPoint {
  T value, d_x, d_xx, d_xy;
};

// With s_xx = E[xx] - m_x^2 and so on: SSIM = A1 A2 / (B1 B2), A1 = 2 m_x m_y + C1,
// A2 = 2 s_xy + C2, B1 = m_x^2 + m_y^2 + C1, B2 = s_xx + s_yy + C2.
// T: float, double or an arithmetic vector type; `one` is 1 in it.
template <typename T>
RETINT_HD SsimPoint<T> Ssim(const SsimMoments<T>& m, T one, T c1, T c2) {
  const T two = one + one;
  const T mxy = m.x * m.y, mm = m.x * m.x + m.y * m.y;
  const T a1 = two * mxy + c1, a2 = two * (m.xy - mxy) + c2;
  const T b1 = mm + c1, b2 = (m.xx + m.yy - mm) + c2;
  const T inverse_b1 = one / b1, inverse_b2 = one / b2;
  const T inverse = inverse_b1 * inverse_b2;
  SsimPoint<T> out;
  out.value = a1 * a2 * inverse;
  out.d_xx = (one - one) - out.value * inverse_b2;
  out.d_xy = two * a1 * inverse;
  out.d_x = two * (m.y * a2 * inverse - m.x * out.value * inverse_b1) - two * m.x * out.d_xx -
            m.y * out.d_xy;
  return out;
}

}  // namespace retint
