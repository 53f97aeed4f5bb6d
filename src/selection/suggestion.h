// SPDX-License-Identifier: BSD-3-Clause
// Which view or photo to paint next: the one whose paint would decide the largest part of the
// uncertain Gaussians.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "base/monitor.h"
#include "render/renderer.h"
#include "scene/reconstruction.h"

namespace retint {

// Views that are painted together: a single view, or all views of one photo, under the photo's
// name.
struct ViewGroup {
  std::string name;
  std::vector<const View*> views;
};

struct ViewSuggestion {
  std::string view;  // the group's name
  // The part that paint on this group would decide after the suggestions before it: the sum over
  // the Gaussians of (1 - confidence) times their visible pixels in all views.
  double settles = 0;
  double fraction = 0;  // of the sum over all uncertain Gaussians
};

// Whether a suggestion would decide anything. None does if paint already shows the whole object, or
// if it covers too few Gaussians to complete the selection.
bool SettlesAnything(std::span<const ViewSuggestion> suggestions);

// The best groups first. The first `count` each assume that those before them are painted; the
// others follow by the part that they would settle on their own. A group settles a Gaussian in
// proportion to its visibility in the views of the group, and completely from half of it on, as in
// a completion (selection/completion.h). `confidence` and `visible` are [N], from ProjectedMasks. A
// group is left out if its name or one of its views is in `painted`. OptionError for arrays of
// another size. Cancelled between views.
std::vector<ViewSuggestion> SuggestViews(Renderer& renderer, const Reconstruction& reconstruction,
                                         const std::vector<ViewGroup>& groups,
                                         const std::vector<std::string>& painted,
                                         std::span<const float> confidence,
                                         std::span<const float> visible, int count,
                                         Monitor& monitor);

}  // namespace retint
