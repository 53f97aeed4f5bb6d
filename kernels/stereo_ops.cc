// SPDX-License-Identifier: BSD-3-Clause
#include "kernels/stereo_ops.h"

#include "kernels/check.h"
#include "kernels/common/stereo.h"

namespace retint {

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
  RequireMatch(params);
  DoMatch(params);
}

void StereoOps::Fuse(const StereoFuseParams& params) {
  RequireCount(params.pixels);
  Require(params.num_pairs >= 1 && params.num_pairs <= kMaxStereoViews,
          "fusion takes 1 to 4 pairs");
  DoFuse(params);
}

void StereoOps::Arbitrate(const StereoArbitrateParams& params) {
  RequireViews(params.reference, params.shifted, params.num_shifted, params.width, params.height);
  DoArbitrate(params);
}

void StereoOps::Refine(const StereoRefineParams& params) {
  RequireViews(params.reference, params.shifted, params.num_shifted, params.width, params.height);
  DoRefine(params);
}

}  // namespace retint
