// SPDX-License-Identifier: BSD-3-Clause
// The census matcher's rules (StereoMatchParams), shared by all backends.
#pragma once

#include <cstdint>

#include "kernels/common/macros.h"
#include "kernels/common/types.h"

namespace retint {

inline constexpr int kCensusU = 4, kCensusV = 3;  // radii of the census window
// A bit for each pixel of the window but the middle, and one that says that all are alike.
inline constexpr int kMaxCensusCost = (2 * kCensusU + 1) * (2 * kCensusV + 1);
static_assert(kMaxCensusCost <= 63);

// Matcher pixels of a pair: u runs along the baseline so that content of the shifted view lies at
// u - s, whichever way the view was shifted. (u, v) is pixel start + u step_u + v step_v of it.
struct MatcherAxes {
  struct Pixel {
    int x, y;
  };
  int width, height;  // extent of u and v
  Pixel start, step_u, step_v;
  RETINT_HD Pixel At(int u, int v) const {
    return {start.x + u * step_u.x + v * step_v.x, start.y + u * step_u.y + v * step_v.y};
  }
};

inline MatcherAxes AxesOf(const StereoView& shifted) {
  const int w = shifted.width, h = shifted.height;
  if (shifted.dx < 0) return {w, h, {0, 0}, {1, 0}, {0, 1}};
  if (shifted.dx > 0) return {w, h, {w - 1, 0}, {-1, 0}, {0, 1}};
  if (shifted.dy < 0) return {h, w, {0, 0}, {0, 1}, {1, 0}};
  return {h, w, {0, h - 1}, {0, -1}, {1, 0}};
}

// To be added to the best disparity, whose cost is `least`, from its neighbors' costs. Two lines
// of one slope: costs grow linearly away from the minimum.
RETINT_HD float SubPixelOffset(int below, int least, int above) {
  const int steeper = (below > above ? below : above) - least;
  return steeper > 0 ? 0.5f * float(below - above) / float(steeper) : 0.0f;
}

// `second` is the least cost of those that are no neighbors of the best.
RETINT_HD bool IsUnique(int least, int second, int uniqueness_percent) {
  return second > least && second * (100 - uniqueness_percent) >= least * 100;
}

}  // namespace retint
