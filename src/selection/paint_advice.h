// SPDX-License-Identifier: BSD-3-Clause
// Whether another view should be painted, and which: a quick look after a selection, of which
// SuggestViews() (selection/suggestion.h) is the whole.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "selection/suggestion.h"

namespace retint {

struct PaintAdvice {
  std::string view;      // the group whose paint settles most, of those that were looked at
  double uncertain = 0;  // share of the Gaussians that touch the selection, by pixels in all views
  double settles = 0;    // share of that which the group's paint would settle
};

// Empty if no group's paint would settle 5 % of the Gaussians that touch the selection: then more
// paint changes little. A Gaussian touches the selection if its share is that of the Gaussians that
// a fit changes, or if it is undecided. Looks at twelve groups at most, drawn small. `shares`,
// `confidence` and `visible` are [N], as ProjectedMasks has them.
std::optional<PaintAdvice> AdvisePaint(Renderer& renderer, const Reconstruction& reconstruction,
                                       const std::vector<ViewGroup>& groups,
                                       const std::vector<std::string>& painted,
                                       std::span<const float> shares,
                                       std::span<const float> confidence,
                                       std::span<const float> visible, Monitor& monitor);

}  // namespace retint
