// SPDX-License-Identifier: BSD-3-Clause
#include "kernels/stereo_ops.h"

#include <string>

#include "kernels/check.h"
#include "kernels/common/stereo_match.h"

namespace retint {
namespace {

void RequireGrid(const StereoView& view, int width, int height) {
  Require(width >= 1 && height >= 1 && view.x <= 0 && view.y <= 0 && view.x + view.width >= width &&
              view.y + view.height >= height,
          "an image of a stereo pair must hold the whole grid");
}

// All hold the whole grid, and every shifted one moves along one axis.
void RequireViews(const StereoView& reference, std::span<const StereoView> shifted, int width,
                  int height) {
  RequireGrid(reference, width, height);
  for (const StereoView& view : shifted) {
    RequireGrid(view, width, height);
    Require(view.dx * view.dx + view.dy * view.dy == 1, "a shifted view moves along one axis");
  }
}

// The first `count` of the views that an operation may take.
std::span<const StereoView> FirstViews(const StereoView (&views)[kMaxStereoViews], int count) {
  Require(count >= 1 && count <= kMaxStereoViews, "stereo takes 1 to 4 shifted views");
  return std::span(views).first(size_t(count));
}

}  // namespace

std::vector<float> StereoOps::PositiveQuantiles(const float* values, int64_t count,
                                                std::span<const double> fractions) {
  RequireCount(count);
  Require(fractions.size() <= size_t(kMaxQuantiles), "at most 8 quantiles are found at a time");
  for (const double fraction : fractions) {
    Require(fraction >= 0 && fraction <= 1, "quantiles lie in [0, 1]");
  }
  if (count == 0) return {};
  return DoPositiveQuantiles(values, count, fractions);
}

void StereoOps::Gray(const float* rgb, int64_t pixels, float* gray) {
  RequireCount(pixels);
  DoGray(rgb, pixels, gray);
}

void StereoOps::Invert(const float* values, const float* otherwise, int64_t count, float scale,
                       float* out) {
  RequireCount(count);
  DoInvert(values, otherwise, count, scale, out);
}

void StereoOps::Match(const StereoMatchParams& params) {
  const StereoView &all = params.reference, &shown = params.shifted;
  RequireViews(all, std::span(&shown, 1), params.width, params.height);
  Require(all.x <= shown.x && all.y <= shown.y && all.x + all.width >= shown.x + shown.width &&
              all.y + all.height >= shown.y + shown.height,
          "the reference must hold what the shifted view shows");
  Require(params.lowest >= 0 && params.count >= kStereoCountStep &&
              params.count <= kMaxStereoCount && params.count % kStereoCountStep == 0,
          "disparities must start at 0 or above and count 32, 64, ... 256");
  if (params.p1 < 0 || params.p2 < params.p1 || kMaxCensusCost + params.p2 > 255) {
    throw std::invalid_argument("penalties must be 0 <= p1 <= p2 <= " +
                                std::to_string(255 - kMaxCensusCost));
  }
  DoMatch(params);
}

void StereoOps::Fuse(const StereoFuseParams& params) {
  RequireCount(params.pixels);
  Require(params.num_pairs >= 1 && params.num_pairs <= kMaxStereoViews,
          "fusion takes 1 to 4 pairs");
  DoFuse(params);
}

void StereoOps::Arbitrate(const StereoArbitrateParams& params) {
  RequireViews(params.reference, FirstViews(params.shifted, params.num_shifted), params.width,
               params.height);
  DoArbitrate(params);
}

void StereoOps::Refine(const StereoRefineParams& params) {
  RequireViews(params.reference, FirstViews(params.shifted, params.num_shifted), params.width,
               params.height);
  DoRefine(params);
}

}  // namespace retint
