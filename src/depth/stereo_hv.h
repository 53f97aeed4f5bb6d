// SPDX-License-Identifier: BSD-3-Clause
// Stereo-HV: depth of a view from rendered stereo pairs. Moving the camera by a baseline beta along
// its own x and y axes gives exactly rectified pairs. A matcher finds the disparity s, and then the
// depth is d = f beta / s (ReCoGS, STAG 2025). Pairs are matched by census (kernels/stereo_ops.h),
// by OpenCV's StereoSGBM or by a network. All stages but the latter two are operations of the
// renderer's backend, in its memory.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "base/option.h"
#include "depth/depth_estimator.h"
#include "depth/stereo_matcher.h"
#include "render/renderer.h"

namespace retint {

enum class StereoAggregate {
  kAgree,  // inverse-depth mean of those that agree; if none agree, the nearest
  kMin,    // the paper's: the least depth
};

enum class StereoMatcherKind {
  kCensus,   // semi-global matching of census transforms, on the backend; where more than
             // kMaxStereoCount disparities are searched, kSgbm, with a warning
  kSgbm,     // OpenCV's StereoSGBM, on the host whatever the backend
  kNetwork,  // the user's own (depth/network_matcher.h)
};

struct StereoHvOptions {
  double baseline = 0;             // beta, world units; 0: chosen from the Gaussians' own depth
  double median_disparity = 0.05;  // of the image's width: where the automatic baseline puts it
  int max_disparities = 128;       // search range, pixels; a multiple of 16
  StereoAggregate aggregate = StereoAggregate::kAgree;
  bool both_sides = true;  // pairs to the left and above too, so that surfaces that one side hides
                           // is measured from the other; the paper's has right and below
  double left_right_tolerance = 1;  // pixels between the two directions of a pair
  double agree_tolerance = 1;       // pixels between pairs
  bool arbitrate =
      true;  // settle disagreements with the Gaussians' depth; false: stereo always wins
  bool subpixel = true;  // sub-pixel refinement against all shifted views at once
  StereoMatcherKind matcher = StereoMatcherKind::kCensus;
  SgbmOptions sgbm;  // of OpenCV's matcher
  // Of kNetwork; null: that of RETINT_MATCHER. It belongs to the machine and may run a program, so
  // that it is no option of the edit: no file of ours names it.
  std::shared_ptr<const StereoMatcher> network;
  void Describe(OptionList& list);
  void Check() const;
};

// The search that stereo makes on a view whose rough depth is known.
struct StereoSearch {
  double baseline = 0;  // along x; along y it is baseline * fx / fy, so disparities compare
  DisparityRange range;
};

// Quantiles of the known rough depths.
struct RoughDepths {
  double near, median, far;
};
inline constexpr double kRoughQuantiles[3] = {0.005, 0.5, 0.995};

// The median of the rough depth lands on `median_disparity`, less where the nearest would leave
// `max_disparities`.
StereoSearch ChooseStereoSearch(const Camera& camera, const RoughDepths& rough,
                                const StereoHvOptions& options);

class StereoHvEstimator : public DepthEstimator {
 public:
  // Keeps the reference: `renderer` outlives the estimator. `matcher` null: that of the options.
  explicit StereoHvEstimator(Renderer& renderer, const StereoHvOptions& options = {},
                             std::unique_ptr<StereoMatcher> matcher = nullptr);
  ~StereoHvEstimator() override;
  // Pixels that no pair measures are filled with the Gaussians' own depth and marked invalid.
  // InputError if the view sees no Gaussian. OptionError if a given baseline moves even the
  // farthest surfaces by more than the image's width. A warning if it moves not even the nearest by
  // a sixteenth of a pixel. If a device has too little memory, the host does it all.
  DepthEstimate Estimate(const PosedCamera& view, Monitor& monitor) override;
  // The baseline is that of the whole view; only the part is rendered, searched and matched.
  DepthEstimate EstimatePart(const PosedCamera& view, const GridRect& part,
                             Monitor& monitor) override;
  std::vector<PosedCamera> Cameras(const PosedCamera& view, Monitor& monitor) override;

 private:
  Renderer& renderer_;
  StereoHvOptions options_;
  bool census_;
  std::shared_ptr<const StereoMatcher> matcher_;  // where census is not asked for, or not possible
};

}  // namespace retint
