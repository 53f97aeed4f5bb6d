// SPDX-License-Identifier: BSD-3-Clause
// The matcher's rules (StereoMatchParams), shared by all backends.
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>

#include "kernels/common/macros.h"
#include "kernels/stereo_ops.h"

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

// To be added to the best disparity, whose cost is `least`, from its neighbours' costs. Two lines
// of one slope: costs grow linearly away from the minimum.
RETINT_HD float SubPixelOffset(int below, int least, int above) {
  const int steeper = (below > above ? below : above) - least;
  return steeper > 0 ? 0.5f * float(below - above) / float(steeper) : 0.0f;
}

// `second` is the least cost of those that are no neighbours of the best.
RETINT_HD bool IsUnique(int least, int second, int uniqueness_percent) {
  return second > least && second * (100 - uniqueness_percent) >= least * 100;
}

// std::invalid_argument unless `view` holds the whole grid.
inline void RequireGrid(const StereoView& view, int width, int height) {
  if (width < 1 || height < 1 || view.x > 0 || view.y > 0 || view.x + view.width < width ||
      view.y + view.height < height) {
    throw std::invalid_argument("an image of a stereo pair must hold the whole grid");
  }
}

// The same for all of them; every shifted one moves along one axis.
inline void RequireViews(const StereoView& reference, const StereoView* shifted, int num_shifted,
                         int width, int height) {
  if (num_shifted < 1 || num_shifted > kMaxStereoViews) {
    throw std::invalid_argument("stereo takes 1 to 4 shifted views");
  }
  RequireGrid(reference, width, height);
  for (int k = 0; k < num_shifted; ++k) {
    RequireGrid(shifted[k], width, height);
    if (shifted[k].dx * shifted[k].dx + shifted[k].dy * shifted[k].dy != 1) {
      throw std::invalid_argument("a shifted view moves along one axis");
    }
  }
}

inline void RequireMatch(const StereoMatchParams& params) {
  RequireViews(params.reference, &params.shifted, 1, params.width, params.height);
  const StereoView &all = params.reference, &shown = params.shifted;
  if (all.x > shown.x || all.y > shown.y || all.x + all.width < shown.x + shown.width ||
      all.y + all.height < shown.y + shown.height) {
    throw std::invalid_argument("the reference must hold what the shifted view shows");
  }
  if (params.lowest < 0 || params.count < kStereoCountStep || params.count > kMaxStereoCount ||
      params.count % kStereoCountStep != 0) {
    throw std::invalid_argument("disparities must start at 0 or above and count 32, 64, ... 256");
  }
  if (params.p1 < 0 || params.p2 < params.p1 || kMaxCensusCost + params.p2 > 255) {
    throw std::invalid_argument("penalties must be 0 <= p1 <= p2 <= " +
                                std::to_string(255 - kMaxCensusCost));
  }
}

}  // namespace retint
