// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/selection/flood.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <utility>
#include <vector>

namespace retint {

Mask FloodFill(const Image8& image, const DepthMap& depth, int x, int y,
               const FloodOptions& options) {
  Mask filled(image.width, image.height);
  if (!filled.Contains(x, y)) return filled;
  const std::array<int, 3> seed = {image(x, y, 0), image(x, y, 1), image(x, y, 2)};
  const auto alike = [&](int px, int py) {
    for (int c = 0; c < 3; ++c) {
      if (std::abs(image(px, py, c) - seed[size_t(c)]) > options.tolerance) return false;
    }
    return true;
  };
  const bool bounded = depth.width == image.width && depth.height == image.height;
  const auto edge = static_cast<float>(options.depth_edge);
  const auto crosses = [&](int ax, int ay, int bx, int by) {
    if (!bounded) return false;
    const float a = depth(ax, ay), b = depth(bx, by);
    if (!(a > 0) || !(b > 0)) return (a > 0) != (b > 0);
    return std::abs(a - b) > edge * std::min(a, b);
  };
  std::vector<std::pair<int, int>> open = {{x, y}};
  filled(x, y) = 255;
  while (!open.empty()) {
    const auto [px, py] = open.back();
    open.pop_back();
    for (const auto& [dx, dy] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
      const int qx = px + dx, qy = py + dy;
      if (!filled.Contains(qx, qy) || filled(qx, qy) || !alike(qx, qy)) continue;
      if (crosses(px, py, qx, qy)) continue;
      filled(qx, qy) = 255;
      open.emplace_back(qx, qy);
    }
  }
  return filled;
}

}  // namespace retint
