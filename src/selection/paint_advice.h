// SPDX-License-Identifier: BSD-3-Clause
// Whether to paint another view, and which one: a quick look after a selection. SuggestViews()
// (selection/suggestion.h) is the full search.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "selection/suggestion.h"

namespace retint {

struct PaintAdvice {
  std::string view;      // group whose paint settles most, of those that were tried
  double uncertain = 0;  // part of the Gaussians that touch the selection, by pixels in all views
  double settles = 0;    // fraction of that which paint on the group would settle
};

// nullopt if no group's paint would settle 5 % of the Gaussians that touch the selection: more
// paint then changes little. A Gaussian touches the selection if its share is so large that a fit
// changes it, or if it is undecided. Tries at most twelve groups, drawn small. `shares`,
// `confidence` and `visible` are [N], from ProjectedMasks.
std::optional<PaintAdvice> AdvisePaint(Renderer& renderer, const Reconstruction& reconstruction,
                                       const std::vector<ViewGroup>& groups,
                                       const std::vector<std::string>& painted,
                                       std::span<const float> shares,
                                       std::span<const float> confidence,
                                       std::span<const float> visible, Monitor& monitor);

}  // namespace retint
