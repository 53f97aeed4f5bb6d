// SPDX-License-Identifier: BSD-3-Clause
#include "depth/stereo_pairs.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>

#include "kernels/common/stereo_match.h"

namespace retint {
namespace {

constexpr int kMargin = 8;  // pixels: matching windows at the border see the scene too

bool IsVertical(Shift shift) { return shift == Shift::kDown || shift == Shift::kUp; }

// Of a pair of images that are shifted so.
MatcherAxes AxesOf(const Image8& image, Shift shift) {
  const Motion motion = MotionOf(shift);
  return AxesOf(StereoView{nullptr, nullptr, 0, 0, image.width, image.height, int32_t(motion.x),
                           int32_t(motion.y)});
}

Image8 ToMatcher(const Image8& image, Shift shift) {
  const MatcherAxes axes = AxesOf(image, shift);
  Image8 out(axes.width, axes.height);
  for (int v = 0; v < out.height; ++v) {
    for (int u = 0; u < out.width; ++u) {
      const auto p = axes.At(u, v);
      std::copy_n(&image(p.x, p.y), 3, &out(u, v));
    }
  }
  return out;
}

// Left and right swapped; on the new left, `padding` columns repeat the border.
Image8 MirrorAndPad(const Image8& image, int padding) {
  Image8 out(image.width + padding, image.height);
  for (int v = 0; v < out.height; ++v) {
    for (int u = 0; u < out.width; ++u) {
      const int from = std::min(image.width - 1, image.width - 1 - (u - padding));
      std::copy_n(&image(from, v), 3, &out(u, v));
    }
  }
  return out;
}

}  // namespace

Motion MotionOf(Shift shift) {
  switch (shift) {
    case Shift::kRight:
      return {-1, 0};
    case Shift::kLeft:
      return {1, 0};
    case Shift::kDown:
      return {0, -1};
    case Shift::kUp:
      return {0, 1};
  }
  return {};
}

PosedCamera CropCamera(const PosedCamera& view, const GridRect& rect) {
  const Camera& camera = view.camera;
  PosedCamera crop = view;
  crop.camera = Camera::Pinhole(camera.id, rect.width, rect.height, camera.fx(), camera.fy(),
                                camera.cx() - rect.x, camera.cy() - rect.y);
  return crop;
}

PosedCamera ShiftCamera(const PosedCamera& view, Shift shift, double baseline) {
  const double vertical = baseline * view.camera.fx() / view.camera.fy();
  PosedCamera shifted = view;
  Eigen::Vector3d& translation = shifted.cam_from_world.translation;
  switch (shift) {  // moving the camera by +b moves the world by -b in its frame
    case Shift::kRight:
      translation.x() -= baseline;
      break;
    case Shift::kLeft:
      translation.x() += baseline;
      break;
    case Shift::kDown:
      translation.y() -= vertical;
      break;
    case Shift::kUp:
      translation.y() += vertical;
      break;
  }
  return shifted;
}

GridRect PairRect(const Camera& camera, Shift shift, int padding) {
  GridRect rect{-kMargin, -kMargin, camera.width + 2 * kMargin, camera.height + 2 * kMargin};
  (IsVertical(shift) ? rect.height : rect.width) += padding;
  if (shift == Shift::kRight) rect.x -= padding;
  if (shift == Shift::kDown) rect.y -= padding;
  return rect;
}

GridRect Union(const GridRect& a, const GridRect& b) {
  const int x = std::min(a.x, b.x), y = std::min(a.y, b.y);
  return {x, y, std::max(a.x + a.width, b.x + b.width) - x,
          std::max(a.y + a.height, b.y + b.height) - y};
}

std::vector<Shift> ShiftsOf(const StereoHvOptions& options) {
  if (!options.both_sides) return {Shift::kRight, Shift::kDown};
  return {Shift::kRight, Shift::kDown, Shift::kLeft, Shift::kUp};
}

std::string StereoReason(size_t num_pairs, const StereoSearch& search, double valid_fraction,
                         const std::string& matcher) {
  return fmt::format(
      "{} rendered pairs{}, baseline {:.4g}, disparities {} to {}, {:.1f} % of the pixels "
      "measured, "
      "the rest from the Gaussians",
      num_pairs, matcher.empty() ? "" : " matched by " + matcher, search.baseline,
      search.range.lowest, search.range.lowest + search.range.count - 1, 100 * valid_fraction);
}

ScalarImage MatchPair(const StereoMatcher& matcher, const RenderedPair& pair, int width, int height,
                      const DisparityRange& range, double tolerance, const Monitor& monitor) {
  const Image8 left = ToMatcher(pair.reference, pair.shift);
  const Image8 right = ToMatcher(pair.shifted, pair.shift);
  const ScalarImage forward = matcher.Match(left, right, range, monitor).disparity;
  // The other way the unmatched columns are on the other side: pad there.
  const int padding = range.lowest + range.count;
  const ScalarImage backward =
      matcher.Match(MirrorAndPad(right, padding), MirrorAndPad(left, padding), range, monitor)
          .disparity;

  const MatcherAxes axes = AxesOf(pair.reference, pair.shift);
  ScalarImage disparity(width, height, -1.0f);
  for (int v = 0; v < forward.height; ++v) {
    for (int u = 0; u < forward.width; ++u) {
      const float s = forward(u, v);
      if (s < 0) continue;
      const int there = u - int(std::lround(s));
      if (there < 0) continue;
      const float back = backward(forward.width - 1 - there + padding, v);
      if (back < 0 || std::abs(back - s) > tolerance) continue;
      const auto p = axes.At(u, v);
      const int x = p.x + pair.rect.x, y = p.y + pair.rect.y;
      if (disparity.Contains(x, y)) disparity(x, y) = s;
    }
  }
  return disparity;
}

bool FitCensus(DisparityRange& range) {
  const int count = (range.count + kStereoCountStep - 1) / kStereoCountStep * kStereoCountStep;
  if (count > kMaxStereoCount) return false;
  range.count = count;
  return true;
}

}  // namespace retint
