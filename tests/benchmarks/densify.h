// SPDX-License-Identifier: BSD-3-Clause
// Larger scenes from real ones, for benchmarks.
#pragma once

#include <cmath>
#include <cstdint>
#include <random>

#include <Eigen/Geometry>

#include "scene/gaussian_model.h"

namespace retint {

// A standard normal value; std::normal_distribution differs between standard libraries.
inline float Normal(std::mt19937& rng) {
  const auto uniform = [&] { return (double(rng() >> 8) + 0.5) * 0x1p-24; };
  return float(std::sqrt(-2 * std::log(uniform())) * std::cos(2 * M_PI * uniform()));
}

// Every Gaussian becomes `children` smaller ones drawn from itself.
inline GaussianModel Densify(const GaussianModel& model, int children, uint32_t seed) {
  std::mt19937 rng(seed);
  GaussianModel dense;
  const size_t count = model.NumGaussians(), block = size_t(model.NumShCoeffs()) * 3;
  dense.Resize(count * size_t(children), model.sh_degree);
  // The children cover about their parent's area between them.
  const float shrink = -0.5f * std::log(float(children));
  for (size_t g = 0; g < count; ++g) {
    const float* q = &model.quats_wxyz[4 * g];
    const Eigen::Matrix3f axes =
        Eigen::Quaternionf(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix();
    for (size_t child = 0; child < size_t(children); ++child) {
      const size_t to = g * size_t(children) + child;
      Eigen::Vector3f offset;
      for (int i = 0; i < 3; ++i) {
        offset[i] = 0.8f * Normal(rng) * std::exp(model.log_scales[3 * g + size_t(i)]);
        dense.log_scales[3 * to + size_t(i)] = model.log_scales[3 * g + size_t(i)] + shrink;
      }
      const Eigen::Vector3f moved = axes * offset;
      for (size_t i = 0; i < 3; ++i) dense.means[3 * to + i] = model.means[3 * g + i] + moved[i];
      std::copy_n(q, 4, &dense.quats_wxyz[4 * to]);
      dense.opacity_logits[to] = model.opacity_logits[g];
      std::copy_n(&model.sh[g * block], block, &dense.sh[to * block]);
    }
  }
  return dense;
}

}  // namespace retint
