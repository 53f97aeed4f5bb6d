// SPDX-License-Identifier: BSD-3-Clause
#include "depth/stereo_pairs.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <vector>

#include "base/error.h"
#include "kernels/stereo_ops.h"

namespace retint {
namespace {

constexpr int kMargin = 8;  // pixels: matching windows at the border see the scene too

struct Pixel {
  int x, y;
};

// Maps matcher pixels (u along the baseline, content of the shifted view lies at u - s) to the
// pair's own.
Pixel FromMatcher(Shift shift, int width, int height, int u, int v) {
  switch (shift) {
    case Shift::kRight:
      return {u, v};
    case Shift::kLeft:
      return {width - 1 - u, v};
    case Shift::kDown:
      return {v, u};
    case Shift::kUp:
      return {v, height - 1 - u};
  }
  return {};
}

bool IsVertical(Shift shift) { return shift == Shift::kDown || shift == Shift::kUp; }

Image8 ToMatcher(const Image8& image, Shift shift) {
  const bool vertical = IsVertical(shift);
  Image8 out(vertical ? image.height : image.width, vertical ? image.width : image.height);
  for (int v = 0; v < out.height; ++v) {
    for (int u = 0; u < out.width; ++u) {
      const Pixel p = FromMatcher(shift, image.width, image.height, u, v);
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

PosedCamera CropCamera(const PosedCamera& view, const PixelRect& rect) {
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

PixelRect PairRect(const Camera& camera, Shift shift, int padding) {
  PixelRect rect{-kMargin, -kMargin, camera.width + 2 * kMargin, camera.height + 2 * kMargin};
  (IsVertical(shift) ? rect.height : rect.width) += padding;
  if (shift == Shift::kRight) rect.x -= padding;
  if (shift == Shift::kDown) rect.y -= padding;
  return rect;
}

PixelRect Union(const PixelRect& a, const PixelRect& b) {
  const int x = std::min(a.x, b.x), y = std::min(a.y, b.y);
  return {x, y, std::max(a.x + a.width, b.x + b.width) - x,
          std::max(a.y + a.height, b.y + b.height) - y};
}

std::vector<Shift> ShiftsOf(const StereoHvOptions& options) {
  if (!options.both_sides) return {Shift::kRight, Shift::kDown};
  return {Shift::kRight, Shift::kDown, Shift::kLeft, Shift::kUp};
}

std::string StereoReason(size_t num_pairs, const StereoSearch& search, double valid_fraction) {
  char reason[160];
  std::snprintf(reason, sizeof(reason),
                "%zu rendered pairs, baseline %.4g, disparities %d to %d, %.1f %% of the pixels "
                "measured, the rest from the Gaussians",
                num_pairs, search.baseline, search.range.lowest,
                search.range.lowest + search.range.count - 1, 100 * valid_fraction);
  return reason;
}

void ThrowNoRoughDepth() {
  throw InputError("the view sees no Gaussian: there is no depth to start from");
}

ScalarImage MatchPair(const StereoMatcher& matcher, const RenderedPair& pair, int width, int height,
                      const DisparityRange& range, double tolerance) {
  const Image8 left = ToMatcher(pair.reference, pair.shift);
  const Image8 right = ToMatcher(pair.shifted, pair.shift);
  const ScalarImage forward = matcher.Match(left, right, range).disparity;
  // The other way the unmatched columns are on the other side: pad there.
  const int padding = range.lowest + range.count;
  const ScalarImage backward =
      matcher.Match(MirrorAndPad(right, padding), MirrorAndPad(left, padding), range).disparity;

  ScalarImage disparity(width, height, -1.0f);
  for (int v = 0; v < forward.height; ++v) {
    for (int u = 0; u < forward.width; ++u) {
      const float s = forward(u, v);
      if (s < 0) continue;
      const int there = u - int(std::lround(s));
      if (there < 0) continue;
      const float back = backward(forward.width - 1 - there + padding, v);
      if (back < 0 || std::abs(back - s) > tolerance) continue;
      const Pixel p = FromMatcher(pair.shift, pair.rect.width, pair.rect.height, u, v);
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

ScalarImage MatchCensus(const ScalarImage& reference, const PixelRect& rect,
                        const ShiftedGray& shifted, int width, int height,
                        const DisparityRange& range, double tolerance) {
  const Motion motion = MotionOf(shifted.shift);
  ScalarImage disparity(width, height);
  MatchStereoOnCpu(
      {.reference = {nullptr, reference.data.data(), rect.x, rect.y, rect.width, rect.height, 0, 0},
       .shifted = {nullptr, shifted.gray.data.data(), shifted.rect.x, shifted.rect.y,
                   shifted.rect.width, shifted.rect.height, motion.x, motion.y},
       .width = width,
       .height = height,
       .lowest = range.lowest,
       .count = range.count,
       .tolerance = float(tolerance),
       .disparity = disparity.data.data()});
  return disparity;
}

ScalarImage FuseDisparities(std::span<const ScalarImage> pairs, StereoAggregate aggregate,
                            double tolerance) {
  ScalarImage fused(pairs.front().width, pairs.front().height, -1.0f);
  std::vector<float> found;  // at this pixel, nearest first
  for (size_t i = 0; i < fused.data.size(); ++i) {
    found.clear();
    for (const ScalarImage& pair : pairs) {
      if (pair.data[i] > 0) found.push_back(pair.data[i]);
    }
    if (found.empty()) continue;
    const size_t count = found.size();
    std::sort(found.begin(), found.end(), std::greater<>());
    if (aggregate == StereoAggregate::kMin) {
      fused.data[i] = found[0];
      continue;
    }
    size_t best_first = 0, best_count = 0;
    for (size_t first = 0; first < count; ++first) {
      size_t last = first;
      while (last < count && found[first] - found[last] <= tolerance) ++last;
      if (last - first > best_count) {
        best_first = first;
        best_count = last - first;
      }
    }
    float sum = 0;
    for (size_t k = best_first; k < best_first + best_count; ++k) sum += found[k];
    fused.data[i] = sum / float(best_count);
  }
  return fused;
}

}  // namespace retint
