// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <string>

#include "base/error.h"
#include "recolor/refit_problem.h"
#include "recolor/sh_refitter.h"

namespace retint {
namespace {

constexpr float kY00 = 0.28209479177387814f;  // the constant SH basis function, 1 / (2 sqrt(pi))

}  // namespace

std::vector<float> ClosedFormSh(std::vector<float> sh, int num_coeffs,
                                std::span<const float> shares, const ColorEdit& edit,
                                double active_threshold) {
  const size_t coeffs = size_t(num_coeffs);
  CheckOption(sh.size() == shares.size() * coeffs * 3,
              "closed form: one share a Gaussian is needed, got " + std::to_string(shares.size()) +
                  " for " + std::to_string(sh.size() / std::max<size_t>(coeffs * 3, 1)));
  const Eigen::Matrix3f delta = edit.gain - Eigen::Matrix3f::Identity();
  // The affine part of delta (0.5 + Y C) + offset that does not depend on the direction.
  const Eigen::Vector3f constant = (0.5f * delta.rowwise().sum() + edit.offset) / kY00;
  for (size_t g = 0; g < shares.size(); ++g) {
    const float share = shares[g];
    if (!(share > active_threshold)) continue;
    for (size_t k = 0; k < coeffs; ++k) {
      float* value = &sh[(g * coeffs + k) * 3];
      const Eigen::Vector3f old(value[0], value[1], value[2]);
      Eigen::Vector3f change = delta * old;
      if (k == 0) change += constant;
      for (int c = 0; c < 3; ++c) {
        // Adding 0 would turn -0 into 0: an identity edit changes no bit.
        if (change[c] != 0) value[c] += share * change[c];
      }
    }
  }
  return sh;
}

std::vector<float> MaskShares(Renderer& renderer, const std::vector<RefitTarget>& targets,
                              Monitor& monitor) {
  const size_t count = size_t(renderer.model().count());
  Backend& backend = renderer.backend();
  const auto sums = backend.Allocate<double>(2 * count);  // inside, altogether
  Buffer<uint8_t> mask;
  for (size_t v = 0; v < targets.size(); ++v) {
    monitor.Step("shares", double(v), double(targets.size()));
    CheckTarget(targets[v]);
    const auto& pixels = targets[v].mask->data;
    if (mask.size() < pixels.size()) mask = backend.Allocate<uint8_t>(pixels.size());
    backend.CopyToDevice(mask.data(), pixels.data(), pixels.size());
    backend.blend().AccumulateShares(*renderer.Geometry(targets[v].camera), mask.data(),
                                     sums.data());
  }
  const auto found = backend.Download(sums.data(), sums.size());
  std::vector<float> shares(count, 0.0f);
  for (size_t g = 0; g < count; ++g) {
    const double inside = found[2 * g], total = found[2 * g + 1];
    if (total > 0) shares[g] = float(std::clamp(inside / total, 0.0, 1.0));
  }
  return shares;
}

}  // namespace retint
