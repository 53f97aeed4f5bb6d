// SPDX-License-Identifier: BSD-3-Clause
// Scenes with values all over the ranges that real ones have, and how far a format may move them.
#pragma once

#include <cmath>
#include <random>
#include <span>

#include <gtest/gtest.h>

#include "scene/gaussian_model.h"

namespace retint {

inline GaussianModel RandomScene(size_t count, int degree, unsigned seed = 1) {
  std::mt19937 random(seed);
  const auto fill = [&](std::span<float> values, float least, float most) {
    std::uniform_real_distribution<float> draw(least, most);
    for (float& value : values) value = draw(random);
  };
  GaussianModel model;
  model.Resize(count, degree);
  fill(model.means, -5, 5);
  fill(model.quats_wxyz, -2, 2);  // neither normalized nor with a positive w
  fill(model.log_scales, -8, 1);
  fill(model.opacity_logits, -4, 4);
  fill(model.sh, -0.5f, 0.5f);
  const size_t width = size_t(model.NumShCoeffs()) * 3;
  std::uniform_real_distribution<float> dc(-1.7f, 1.7f);  // colors from 0.02 to 0.98
  for (size_t g = 0; g < count; ++g) {
    for (size_t c = 0; c < 3; ++c) model.sh[g * width + c] = dc(random);
  }
  return model;
}

// The largest differences that a format's rounding may make.
struct Rounding {
  double mean, log_scale, opacity, color, sh, rotation;
};

// Gaussian `order[g]` of `before`, or g where that is empty, is Gaussian g of `after`.
inline void ExpectNear(const GaussianModel& before, const GaussianModel& after,
                       const Rounding& most, const std::vector<uint32_t>& order = {}) {
  ASSERT_EQ(after.NumGaussians(), before.NumGaussians());
  const auto opacity = [](float logit) { return 1 / (1 + std::exp(-double(logit))); };
  const size_t from_width = size_t(before.NumShCoeffs()) * 3;
  const size_t width = size_t(after.NumShCoeffs()) * 3;
  for (size_t g = 0; g < after.NumGaussians(); ++g) {
    SCOPED_TRACE(g);
    const size_t f = order.empty() ? g : order[g];
    for (size_t i = 0; i < 3; ++i) {
      ASSERT_NEAR(after.means[g * 3 + i], before.means[f * 3 + i], most.mean);
      ASSERT_NEAR(after.log_scales[g * 3 + i], before.log_scales[f * 3 + i], most.log_scale);
      ASSERT_NEAR(0.28209479 * after.sh[g * width + i], 0.28209479 * before.sh[f * from_width + i],
                  most.color);
    }
    ASSERT_NEAR(opacity(after.opacity_logits[g]), opacity(before.opacity_logits[f]), most.opacity);
    for (size_t i = 3; i < std::min(width, from_width); ++i) {
      ASSERT_NEAR(after.sh[g * width + i], before.sh[f * from_width + i], most.sh) << i;
    }
    double norm[2] = {0, 0}, dot = 0;
    for (size_t i = 0; i < 4; ++i) {
      const double a = after.quats_wxyz[g * 4 + i], b = before.quats_wxyz[f * 4 + i];
      norm[0] += a * a;
      norm[1] += b * b;
      dot += a * b;
    }
    const double sign = dot < 0 ? -1 : 1;
    for (size_t i = 0; i < 4; ++i) {
      ASSERT_NEAR(after.quats_wxyz[g * 4 + i] / std::sqrt(norm[0]),
                  sign * before.quats_wxyz[f * 4 + i] / std::sqrt(norm[1]), most.rotation);
    }
  }
}

}  // namespace retint
