// SPDX-License-Identifier: BSD-3-Clause
// A smooth function of every pixel of a picture, which costs much where it is computed and next to
// nothing where it follows from its values about. Internal to scene and code that draws through
// lenses.
#pragma once

#include <algorithm>
#include <array>
#include <optional>

#include <Eigen/Core>

#include "base/parallel.h"

namespace retint {

// Calls write(x, y, value) for each pixel, on many threads. `value` is find(x + 0.5, y + 0.5), an
// optional Vector, or the quadratic through nine points of a block. The quadratic is used if it is
// right to `tolerance` in the middles of the block's quarters. Pixels for which find() has no value
// are not written.
template <typename Vector, typename Find, typename Write>
void ForSmooth(int width, int height, double tolerance, const Find& find, const Write& write) {
  constexpr int kBlock = 64, kLeast = 8;  // pixels a side
  using Line = std::array<int, 3>;
  const auto weights = [](const Line& nodes, int at) {
    std::array<double, 3> result;
    for (size_t i = 0; i < 3; ++i) {
      const int j = nodes[(i + 1) % 3], k = nodes[(i + 2) % 3];
      result[i] = double(at - j) * (at - k) / (double(nodes[i] - j) * (nodes[i] - k));
    }
    return result;
  };
  // The pixels [x0, x1) x [y0, y1).
  const auto fill = [&](const auto& self, int x0, int y0, int x1, int y1) -> void {
    const Line xs = {x0, (x0 + x1) / 2, x1}, ys = {y0, (y0 + y1) / 2, y1};
    if (x1 - x0 <= kLeast || y1 - y0 <= kLeast) {
      for (int y = y0; y < y1; ++y) {
        for (int x = x0; x < x1; ++x) {
          if (const std::optional<Vector> value = find(x + 0.5, y + 0.5)) write(x, y, *value);
        }
      }
      return;
    }
    bool follows = true;
    std::array<std::array<Vector, 3>, 3> nodes;  // by row
    for (size_t j = 0; follows && j < 3; ++j) {
      for (size_t i = 0; follows && i < 3; ++i) {
        const std::optional<Vector> value = find(xs[i] + 0.5, ys[j] + 0.5);
        follows = value.has_value();
        if (follows) nodes[j][i] = *value;
      }
    }
    // Of a row: the three values that its pixels mix.
    const auto row = [&](int y) {
      const auto wy = weights(ys, y);
      std::array<Vector, 3> mixed;
      for (size_t i = 0; i < 3; ++i) {
        mixed[i] = wy[0] * nodes[0][i] + wy[1] * nodes[1][i] + wy[2] * nodes[2][i];
      }
      return mixed;
    };
    const auto at = [&](const std::array<Vector, 3>& mixed, int x) -> Vector {
      const auto wx = weights(xs, x);
      return wx[0] * mixed[0] + wx[1] * mixed[1] + wx[2] * mixed[2];
    };
    for (size_t quarter = 0; follows && quarter < 4; ++quarter) {
      const int x = (xs[quarter % 2] + xs[quarter % 2 + 1]) / 2;
      const int y = (ys[quarter / 2] + ys[quarter / 2 + 1]) / 2;
      const std::optional<Vector> value = find(x + 0.5, y + 0.5);
      follows = value && (at(row(y), x) - *value).cwiseAbs().maxCoeff() <= tolerance;
    }
    if (follows) {
      for (int y = y0; y < y1; ++y) {
        const auto mixed = row(y);
        for (int x = x0; x < x1; ++x) write(x, y, at(mixed, x));
      }
      return;
    }
    for (size_t j = 0; j < 2; ++j) {
      for (size_t i = 0; i < 2; ++i) self(self, xs[i], ys[j], xs[i + 1], ys[j + 1]);
    }
  };
  const int across = (width + kBlock - 1) / kBlock, down = (height + kBlock - 1) / kBlock;
  ParallelTasks(int64_t(across) * down, [&](int64_t block) {
    const int x0 = int(block % across) * kBlock, y0 = int(block / across) * kBlock;
    fill(fill, x0, y0, std::min(x0 + kBlock, width), std::min(y0 + kBlock, height));
  });
}

}  // namespace retint
