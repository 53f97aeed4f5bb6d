// SPDX-License-Identifier: BSD-3-Clause
#include "selection/depth_sampling.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <opencv2/imgproc.hpp>

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
      // Stop before a depth edge, so that the slope is of this surface alone.
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

cv::Mat View8(const Mask& mask) {
  return cv::Mat(mask.height, mask.width, CV_8UC1, const_cast<uint8_t*>(mask.data.data()));
}

Mask Morph(const Mask& mask, int radius, int operation) {
  if (radius <= 0 || mask.Empty()) return mask;
  Mask out(mask.width, mask.height);
  const int side = 2 * radius + 1;
  cv::Mat target = View8(out);
  cv::morphologyEx(View8(mask), target, operation,
                   cv::getStructuringElement(cv::MORPH_ELLIPSE, {side, side}));
  return out;
}

}  // namespace

std::optional<double> SampleDepth(const DepthMap& depth, const Eigen::Vector2d& pixel,
                                  double max_spread) {
  if (!(pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() < depth.width && pixel.y() < depth.height)) {
    return std::nullopt;
  }
  const double x = std::clamp(pixel.x() - 0.5, 0.0, depth.width - 1.0);
  const double y = std::clamp(pixel.y() - 0.5, 0.0, depth.height - 1.0);
  const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
  const int x1 = std::min(x0 + 1, depth.width - 1), y1 = std::min(y0 + 1, depth.height - 1);
  double low = std::numeric_limits<double>::infinity(), high = 0, inverse = 0;
  for (int corner = 0; corner < 4; ++corner) {
    const int i = corner & 1 ? x1 : x0, j = corner & 2 ? y1 : y0;
    if (!HasDepth(depth, i, j)) return std::nullopt;
    const double z = depth(i, j);
    low = std::min(low, z);
    high = std::max(high, z);
    inverse += (corner & 1 ? x - x0 : 1 - (x - x0)) * (corner & 2 ? y - y0 : 1 - (y - y0)) / z;
  }
  if (high - low > max_spread * low) return std::nullopt;
  return 1 / inverse;
}

Eigen::Vector3d NormalFromDepth(const Camera& camera, const DepthMap& depth, int x, int y) {
  const Eigen::Vector2d ray = *camera.CamFromImg({x + 0.5, y + 0.5});
  const double slope_u = InverseDepthSlope(depth, x, y, 1, 0) * camera.fx();
  const double slope_v = InverseDepthSlope(depth, x, y, 0, 1) * camera.fy();
  const double offset = 1.0 / depth(x, y) - slope_u * ray.x() - slope_v * ray.y();
  return -Eigen::Vector3d(slope_u, slope_v, offset).normalized();
}

Mask Dilate(const Mask& mask, int radius) { return Morph(mask, radius, cv::MORPH_DILATE); }

Mask Close(const Mask& mask, int radius) { return Morph(mask, radius, cv::MORPH_CLOSE); }

}  // namespace retint
