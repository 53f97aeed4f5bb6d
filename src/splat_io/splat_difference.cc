// SPDX-License-Identifier: BSD-3-Clause
#include "splat_io/splat_difference.h"

#include <array>

#include "splat_io/splat_row.h"

namespace retint {
namespace {

constexpr size_t kDirections = 14;  // along the axes and the diagonals of a cube

using Basis = std::array<std::array<float, 16>, kDirections>;

Basis DirectionBasis() {
  Basis basis;
  size_t next = 0;
  for (int x = -1; x <= 1; ++x) {
    for (int y = -1; y <= 1; ++y) {
      for (int z = -1; z <= 1; ++z) {
        const int squares = x * x + y * y + z * z;
        if (squares != 1 && squares != 3) continue;
        const float norm = std::sqrt(static_cast<float>(squares));
        ShBasis(3, static_cast<float>(x) / norm, static_cast<float>(y) / norm,
                static_cast<float>(z) / norm, basis[next++].data());
      }
    }
  }
  return basis;
}

// Rows are zero above their own degree.
double ColorDifference(const SplatRow& a, const SplatRow& b, size_t coefficients,
                       const Basis& basis) {
  double most = 0;
  for (const std::array<float, 16>& y : basis) {
    for (size_t c = 0; c < 3; ++c) {
      double color_a = 0.5, color_b = 0.5;
      for (size_t k = 0; k < coefficients; ++k) {
        color_a += static_cast<double>(y[k]) * a.sh[3 * k + c];
        color_b += static_cast<double>(y[k]) * b.sh[3 * k + c];
      }
      most =
          std::max(most, std::abs(std::clamp(color_a, 0.0, 1.0) - std::clamp(color_b, 0.0, 1.0)));
    }
  }
  return most;
}

}  // namespace

SplatDifference Compare(const GaussianModel& before, const GaussianModel& after,
                        std::span<const uint32_t> order) {
  static const Basis basis = DirectionBasis();
  const auto coefficients =
      static_cast<size_t>(std::max(before.NumShCoeffs(), after.NumShCoeffs()));
  const size_t count = after.NumGaussians();
  SplatDifference difference;
  double log_ratio = 0;
  for (size_t g = 0; g < count; ++g) {
    const SplatRow a = GetRow(before, order.empty() ? g : order[g]), b = GetRow(after, g);
    double squares = 0;
    for (size_t i = 0; i < 3; ++i) {
      const double d = double{a.mean[i]} - b.mean[i];
      squares += d * d;
      log_ratio = std::max(log_ratio, std::abs(double{a.log_scale[i]} - b.log_scale[i]));
    }
    const double color = ColorDifference(a, b, coefficients, basis);
    difference.position_max = std::max(difference.position_max, std::sqrt(squares));
    difference.position_rms += squares / static_cast<double>(count);
    difference.color_max = std::max(difference.color_max, color);
    difference.color_rms += color * color / static_cast<double>(count);
    difference.opacity_max = std::max(
        difference.opacity_max, std::abs(Sigmoid(a.opacity_logit) - Sigmoid(b.opacity_logit)));
  }
  difference.position_rms = std::sqrt(difference.position_rms);
  difference.color_rms = std::sqrt(difference.color_rms);
  difference.scale_ratio_max = std::exp(log_ratio);
  return difference;
}

}  // namespace retint
