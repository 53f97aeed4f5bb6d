// SPDX-License-Identifier: BSD-3-Clause
#include "selection/depth_sampling.h"

#include <algorithm>
#include <cmath>

#include "kernels/backend.h"
#include "kernels/common/mask_projection.h"

namespace retint {
namespace {

// Slope of 1/z per pixel along (dx, dy) at (x, y).
double InverseDepthSlope(const DepthMap& depth, int x, int y, int dx, int dy) {
  constexpr int kReach = 3;
  constexpr double kEdge = 0.01;  // a slope difference of 1 % of depth a pixel is an edge
  const double center = 1.0 / depth(x, y);
  double slope[2];
  bool known[2] = {false, false};
  for (int side = 0; side < 2; ++side) {
    const int sign = side == 0 ? -1 : 1;
    for (int step = 1; step <= kReach; ++step) {
      const int i = x + sign * step * dx, j = y + sign * step * dy;
      if (!depth.Contains(i, j) || !HasDepth(depth, i, j)) break;
      const double candidate = sign * (1.0 / depth(i, j) - center) / step;
      // Stop before a depth edge, so that the slope is of this surface only.
      if (known[side] && std::abs(candidate - slope[side]) > kEdge * center) break;
      slope[side] = candidate;
      known[side] = true;
    }
  }
  if (known[0] && known[1]) {
    if (std::abs(slope[0] - slope[1]) <= kEdge * center) return 0.5 * (slope[0] + slope[1]);
    return std::abs(slope[0]) < std::abs(slope[1]) ? slope[0] : slope[1];
  }
  return known[0] ? slope[0] : known[1] ? slope[1] : 0.0;
}

}  // namespace

std::optional<double> SampleDepth(const DepthMap& depth, const Eigen::Vector2d& pixel,
                                  double max_spread) {
  const double z = SampleDepthAt(depth.data.data(), depth.width, depth.height, kAllPixelRows,
                                 pixel.x(), pixel.y(), max_spread);
  return z > 0 ? std::optional(z) : std::nullopt;
}

Eigen::Vector3d NormalFromDepth(const Camera& camera, const DepthMap& depth, int x, int y) {
  const Eigen::Vector2d ray = *camera.CamFromImg({x + 0.5, y + 0.5});
  const double slope_u = InverseDepthSlope(depth, x, y, 1, 0) * camera.fx();
  const double slope_v = InverseDepthSlope(depth, x, y, 0, 1) * camera.fy();
  const double offset = 1.0 / depth(x, y) - slope_u * ray.x() - slope_v * ray.y();
  return -Eigen::Vector3d(slope_u, slope_v, offset).normalized();
}

bool IsNearMask(const Mask& mask, int x, int y, int radius) {
  if (mask.Contains(x, y) && mask(x, y) > 0) return true;
  for (int row = std::max(0, y - radius); row <= std::min(mask.height - 1, y + radius); ++row) {
    const int reach = DiscReach(radius, row - y);
    const int begin = std::max(0, x - reach), end = std::min(mask.width, x + reach + 1);
    if (begin >= end) continue;
    const auto first = mask.data.begin() + static_cast<std::ptrdiff_t>(mask.Index(begin, row));
    if (std::any_of(first, first + (end - begin), [](uint8_t value) { return value > 0; })) {
      return true;
    }
  }
  return false;
}

}  // namespace retint
