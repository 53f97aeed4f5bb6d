// SPDX-License-Identifier: BSD-3-Clause
#include "selection/view_depth.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/LU>

#include "selection/depth_sampling.h"

namespace retint {

DepthBias FitDepthBias(const DepthMap& rendered, const PosedCamera& posed, const View& view,
                       const Reconstruction& reconstruction, double max_relative) {
  constexpr int kLeastPoints = 10, kIterations = 20;
  constexpr double kPrior = 0.1;  // of a - 1, and of b times the depth
  constexpr double kLeastNoise = 1e-3;
  struct Pair {
    double rendered, sparse;
  };
  std::vector<Pair> pairs;
  for (const auto& observation : view.observations) {
    const auto found = reconstruction.points.find(observation.point_id);
    if (found == reconstruction.points.end()) continue;
    const auto projected = posed.Project(found->second.xyz);
    if (!projected) continue;
    const auto z = SampleDepth(rendered, projected->head<2>());
    if (z && std::abs(*z - projected->z()) <= max_relative * projected->z()) {
      pairs.push_back({*z, projected->z()});
    }
  }
  DepthBias bias;
  if (static_cast<int>(pairs.size()) < kLeastPoints) return bias;
  bias.points = static_cast<int>(pairs.size());
  std::vector<double> scratch(pairs.size());
  const auto median = [&](auto value) {
    std::transform(pairs.begin(), pairs.end(), scratch.begin(), value);
    const auto middle = scratch.begin() + static_cast<std::ptrdiff_t>(scratch.size() / 2);
    std::nth_element(scratch.begin(), middle, scratch.end());
    return *middle;
  };
  const double depth = median([](const Pair& pair) { return pair.sparse; });
  // Residual (a / z_rendered + b) z_sparse - 1 in the unknowns (a, b * depth).
  const auto residual = [&](const Pair& pair) {
    return (bias.a / pair.rendered + bias.b) * pair.sparse - 1;
  };
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    const double noise = std::max(
        kLeastNoise, 1.4826 * median([&](const Pair& p) { return std::abs(residual(p)); }));
    Eigen::Matrix2d normal = Eigen::Matrix2d::Identity() * (noise / kPrior) * (noise / kPrior);
    Eigen::Vector2d right = normal * Eigen::Vector2d(1, 0);
    for (const auto& pair : pairs) {
      const double r = residual(pair) / noise;
      const double weight = 1 / (1 + r * r);
      const Eigen::Vector2d row(pair.sparse / pair.rendered, pair.sparse / depth);
      normal += weight * row * row.transpose();
      right += weight * row;
    }
    const Eigen::Vector2d solution = normal.inverse() * right;
    bias.a = std::clamp(solution[0], 0.8, 1.25);
    bias.b = std::clamp(solution[1], -0.2, 0.2) / depth;
  }
  return bias;
}

DepthMap SurfaceDepth(Renderer& renderer, const PosedCamera& posed, const View* view,
                      const Reconstruction& reconstruction, uint16_t pixel_rows) {
  constexpr float kOpaque = 0.5f;  // a pixel less opaque than this shows no surface
  RenderRequest request;
  request.rgb = false;
  request.depth_expected = true;
  request.alpha = true;
  request.pixel_rows = pixel_rows;
  RenderOutput output = renderer.Render(posed, request);
  DepthMap& depth = output.depth_expected;
  const auto width = static_cast<size_t>(depth.width);
  for (int y = 0; y < depth.height; ++y) {
    float* const row = depth.data.data() + static_cast<size_t>(y) * width;
    if (!(pixel_rows >> (y % kTileSize) & 1)) {
      std::copy_n(row - width, width, row);
      continue;
    }
    const float* const alpha = output.alpha.data.data() + static_cast<size_t>(y) * width;
    for (size_t x = 0; x < width; ++x) {
      if (alpha[x] < kOpaque) row[x] = 0;
    }
  }
  if (view) CorrectDepth(FitDepthBias(depth, posed, *view, reconstruction), &depth);
  return std::move(depth);
}

void CorrectDepth(const DepthBias& bias, DepthMap* depth) {
  const auto a = static_cast<float>(bias.a), b = static_cast<float>(bias.b);
  for (float& z : depth->data) {
    const float divisor = a + b * z;
    z = z > 0 && divisor > 0.1f ? z / divisor : 0;
  }
}

}  // namespace retint
