// SPDX-License-Identifier: BSD-3-Clause
// Which view or photo to paint next: the one whose paint would decide most of the uncertain
// Gaussians.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "base/monitor.h"
#include "render/renderer.h"
#include "scene/reconstruction.h"

namespace retint {

// The pictures that are painted at once: a view or, by the photo's name, the views that show a
// photo.
struct ViewGroup {
  std::string name;
  std::vector<const View*> views;
};

struct ViewSuggestion {
  std::string view;  // the group's name
  // The part that paint on this group would decide, once those suggested before it are painted: sum
  // over the Gaussians of (1 - confidence) times the pixels in which they show, over all views.
  double settles = 0;
  double fraction = 0;  // of all that is uncertain
};

// Whether a suggestion would settle anything. Nothing is uncertain where paint shows the whole
// object, and where it covers too few Gaussians to complete the selection from them.
bool SettlesAnything(std::span<const ViewSuggestion> suggestions);

// The best groups first. The first `count` take into account that those before them settle a part;
// the rest follow by the part that they would settle by themselves. A Gaussian is settled in
// proportion to its visibility in the views of a group together, and altogether from half of its
// visibility on, as in a completion (selection/completion.h). `confidence` and `visible` are [N],
// as ProjectedMasks has them; no group is suggested whose name, or a view's of it, is in `painted`.
// OptionError for arrays of another size. Cancelled between views.
std::vector<ViewSuggestion> SuggestViews(Renderer& renderer, const Reconstruction& reconstruction,
                                         const std::vector<ViewGroup>& groups,
                                         const std::vector<std::string>& painted,
                                         std::span<const float> confidence,
                                         std::span<const float> visible, int count,
                                         Monitor& monitor);

}  // namespace retint
