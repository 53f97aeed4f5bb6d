// SPDX-License-Identifier: BSD-3-Clause
// The options of the depth methods, described; how they are put together is in factory.cc.
#include "base/error.h"
#include "depth/colmap_depth.h"
#include "depth/gaussian.h"
#include "depth/stereo_hv.h"

namespace retint {

void GaussianDepthOptions::Describe(OptionList& list) {
  list.push_back({.name = "kind",
                  .member = ChoiceOf(kind, {"median", "expected"}),
                  .help = "the depth at which a ray is half absorbed, or the blended mean"});
  list.push_back({.name = "tau",
                  .member = &tau,
                  .range = OptionRange::Between(0, 1),
                  .help = "transmittance at the median"});
  list.push_back({.name = "min_alpha",
                  .member = &min_alpha,
                  .range = OptionRange::Between(0, 1),
                  .help = "pixels less opaque than this have no depth"});
}

void GaussianDepthOptions::Check() const { CheckRanges(*this); }

void SgbmOptions::Describe(OptionList& list) {
  list.push_back({.name = "block_size",
                  .member = &block_size,
                  .range = OptionRange::Closed(1, 21),
                  .help = "side of the compared blocks, an odd number",
                  .unit = "pixels"});
  list.push_back({.name = "smoothness",
                  .member = &smoothness,
                  .range = OptionRange::AtLeast(1),
                  .help = "penalty of a change of one disparity"});
  list.push_back({.name = "jump",
                  .member = &jump,
                  .range = OptionRange::AtLeast(2),
                  .help = "penalty of a larger change; above smoothness"});
  list.push_back({.name = "uniqueness_percent",
                  .member = &uniqueness_percent,
                  .range = OptionRange::Closed(0, 99),
                  .help = "margin by which the best cost must beat the second best",
                  .unit = "percent"});
  list.push_back({.name = "speckle_pixels",
                  .member = &speckle_pixels,
                  .range = OptionRange::AtLeast(0),
                  .help = "smaller isolated patches are dropped; 0 keeps all",
                  .unit = "pixels"});
  list.push_back({.name = "coarse_tolerance",
                  .member = &left_right_tolerance,
                  .range = OptionRange::AtLeast(-1),
                  .help = "of OpenCV's own comparison of both directions; -1 switches it off",
                  .unit = "pixels"});
  list.push_back({.name = "all_paths",
                  .member = &all_paths,
                  .help = "add costs up along eight paths, not three"});
}

void SgbmOptions::Check() const {
  CheckRanges(*this);
  CheckOption(block_size % 2 == 1, "block size must be odd");
  CheckOption(jump > smoothness, "smoothness must be below jump");
}

void StereoHvOptions::Describe(OptionList& list) {
  list.push_back({.name = "aggregate",
                  .member = ChoiceOf(aggregate, {"agree", "min"}),
                  .help = "agree (mean where pairs agree, else nearest) or min (the paper's)",
                  .title = "Combine pairs by",
                  .tier = OptionTier::kExpert});
  list.push_back({.name = "matcher",
                  .member = ChoiceOf(matcher, {"census", "sgbm", "network"}),
                  .help = "census (for up to 256 disparities), sgbm (OpenCV's, on the CPU) or "
                          "network (your own: the one that RETINT_MATCHER names)",
                  .tier = OptionTier::kExpert});
  list.push_back({.name = "both_sides",
                  .member = &both_sides,
                  .help = "pairs to the left and above too; the paper has right and below",
                  .title = "Pairs on all four sides",
                  .tier = OptionTier::kExpert});
  list.push_back({.name = "arbitrate",
                  .member = &arbitrate,
                  .help = "where stereo and the Gaussians' own depth disagree, let the colors of "
                          "the pairs decide; the paper always takes stereo's",
                  .title = "Colors decide between depths",
                  .tier = OptionTier::kExpert});
  list.push_back(
      {.name = "subpixel",
       .member = &subpixel,
       .help =
           "find disparities to parts of a pixel, against all pairs at once; the paper does not",
       .tier = OptionTier::kExpert});
  list.push_back({.name = "baseline",
                  .member = &baseline,
                  .range = OptionRange::AtLeast(0),
                  .help = "baseline in the workspace's unit; 0 chooses it",
                  .tier = OptionTier::kExpert});
  list.push_back({.name = "max_disparities",
                  .member = &max_disparities,
                  .range = {.min = 16, .max = 1024, .multiple_of = 16},
                  .help = "search range",
                  .unit = "pixels",
                  .tier = OptionTier::kExpert});
  list.push_back({.name = "median_disparity",
                  .member = &median_disparity,
                  .range = OptionRange::AboveTo(0, 0.5),
                  .help = "share of the width at which the chosen baseline puts the median"});
  list.push_back({.name = "left_right_tolerance",
                  .member = &left_right_tolerance,
                  .range = OptionRange::AtLeast(0),
                  .help = "between the two directions of a pair",
                  .unit = "pixels"});
  list.push_back({.name = "agree_tolerance",
                  .member = &agree_tolerance,
                  .range = OptionRange::AtLeast(0),
                  .help = "between pairs",
                  .unit = "pixels"});
  DescribePart(sgbm, "sgbm", list);
}

void StereoHvOptions::Check() const {
  CheckRanges(*this);
  sgbm.Check();
}

void ColmapDepthOptions::Describe(OptionList& list) {
  list.push_back({.name = "max_sources",
                  .member = &max_sources,
                  .range = OptionRange::AtLeast(1),
                  .help = "nearest images whose maps are used"});
  list.push_back({.name = "edge_tolerance",
                  .member = &edge_tolerance,
                  .range = OptionRange::Between(0, 1),
                  .help = "relative step of depth across which a map is not interpolated"});
  list.push_back({.name = "map_tolerance",
                  .member = &agree_tolerance,
                  .range = OptionRange::Between(0, 1),
                  .help = "relative difference between maps that see one surface"});
}

void ColmapDepthOptions::Check() const { CheckRanges(*this); }

}  // namespace retint
