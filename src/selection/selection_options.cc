// SPDX-License-Identifier: BSD-3-Clause
// Describes the options of this folder.
#include "selection/mask_projector.h"
#include "selection/registration.h"
#include "selection/selection_cloud.h"

namespace retint {

void CloudOptions::Describe(OptionList& list) {
  list.push_back({.name = "sample_fraction",
                  .member = &sample_fraction,
                  .range = OptionRange::AboveTo(0, 1),
                  .help = "share of the mask's pixels made points",
                  .tier = OptionTier::kExpert});
  list.push_back({.name = "outlier_neighbors",
                  .member = &outlier_neighbors,
                  .range = OptionRange::Closed(0, 1000),
                  .help = "neighbors of the outlier filter; 0 keeps all points",
                  .tier = OptionTier::kExpert});
  list.push_back(
      {.name = "outlier_stddev",
       .member = &outlier_stddev,
       .help = "standard deviations above the mean neighbor distance that a point may lie",
       .title = "Outlier distance",
       .tier = OptionTier::kExpert});
  list.push_back({.name = "cloud_seed", .member = &seed, .help = "of the choice of pixels"});
}

void CloudOptions::Check() const { CheckRanges(*this); }

void RegistrationOptions::Describe(OptionList& list) {
  list.push_back({.name = "heldout_fraction",
                  .member = &heldout_fraction,
                  .range = OptionRange::Between(0, 1),
                  .help = "share of the sparse points kept for checking the result"});
  list.push_back(
      {.name = "registration_seed", .member = &seed, .help = "of the choice of points held out"});
}

void RegistrationOptions::Check() const { CheckRanges(*this); }

void ProjectorOptions::Describe(OptionList& list) {
  list.push_back(
      {.name = "projector",
       .member = ChoiceOf(kind, {"quads", "surfels", "gaussians"}),
       .help = "how masks are drawn: quads (the paper's), surfels, or gaussians (lifted to shares, "
               "rendered again)",
       .tier = OptionTier::kExpert});
  list.push_back({.name = "quad_pixels",
                  .member = &quad_pixels,
                  .range = OptionRange::Closed(1, 100),
                  .help = "side of a quad",
                  .title = "Square a point, pixels",
                  .unit = "pixels",
                  .applies = "quads",
                  .tier = OptionTier::kExpert});
  list.push_back({.name = "depth_tolerance",
                  .member = &depth_tolerance,
                  .range = OptionRange::Closed(0, 1),
                  .help = "relative depth behind which a point is hidden",
                  .tier = OptionTier::kExpert});
  list.push_back({.name = "share_threshold",
                  .member = &share_threshold,
                  .range = OptionRange::Between(0, 1),
                  .help = "rendered share above which a pixel is inside",
                  .title = "Inside from a share of",
                  .applies = "gaussians",
                  .tier = OptionTier::kExpert});
  list.push_back({.name = "painted_weight",
                  .member = &painted_weight,
                  .range = OptionRange::AboveTo(0, 1e6),
                  .help = "weight of a painted view's pixels as evidence",
                  .applies = "gaussians",
                  .tier = OptionTier::kExpert});
  list.push_back({.name = "completion",
                  .member = ChoiceOf(completion, {"off", "near", "all"}),
                  .help = "how far paint goes: off (this surface), near (the whole object) or all "
                          "(also other things that look the same)",
                  .applies = "gaussians",
                  .tier = OptionTier::kEveryday});
  list.push_back({.name = "paint_slack",
                  .member = &paint_slack,
                  .range = OptionRange::Closed(0, 0.1),
                  .help = "for rough brushes: if an edge of color or depth lies this close to the "
                          "border of a painted mask, as a share of the picture's longer side, the "
                          "border moves to it; 0 keeps the border",
                  .applies = "gaussians",
                  .tier = OptionTier::kOccasional});
  list.push_back({.name = "unknown_weight",
                  .member = &unknown_weight,
                  .range = OptionRange::Closed(0, 1),
                  .help = "without completion, weight against surfaces that no painted view sees",
                  .applies = "gaussians",
                  .tier = OptionTier::kExpert});
  list.push_back({.name = "visible_tolerance",
                  .member = &visible_tolerance,
                  .range = OptionRange::AboveTo(0, 1),
                  .help =
                      "largest relative depth difference at which a painted view sees a surface; "
                      "less if the depths of the views agree",
                  .applies = "gaussians",
                  .tier = OptionTier::kExpert});
}

void ProjectorOptions::Check() const { CheckRanges(*this); }

}  // namespace retint
