// SPDX-License-Identifier: BSD-3-Clause
// Registers the depth and cloud of a selection to COLMAP's sparse points.
#pragma once

#include <cstdint>
#include <string>

#include "base/option.h"
#include "scene/image.h"
#include "scene/reconstruction.h"
#include "selection/selection_cloud.h"

namespace retint {

// The mask is dilated by this many pixels to gather sparse points.
inline constexpr int kRegistrationMargin = 15;

struct RegistrationOptions {
  double heldout_fraction = 0.2;  // of the points, for the never-worse check
  uint64_t seed = 0;
  void Describe(OptionList& list);
  void Check() const;
};

struct RegistrationSummary {
  int points_used = 0, points_heldout = 0;
  // Root mean square distances, world units, over the used and the held-out points.
  double rms_before = 0, rms_after = 0, heldout_before = 0, heldout_after = 0;
  double a = 1, b = 0;     // 1/d' = a (1/d) + b in the reference camera
  Sim3d world_from_cloud;  // then this similarity
  bool accepted = false;   // false: identity was kept
  std::string reason;      // why it stopped or fell back
  std::string BriefReport() const;
};

// Estimates 1/d' = a/d + b and then a small Sim(3), robustly and with priors at identity. Applies
// them to `cloud` unless they make the held-out residual worse. `depth` is the map from which the
// cloud of `view` was made. `training_view` is the view of `reconstruction` with the camera `view`;
// its observations choose the sparse points. null: a free camera, for which all sparse points
// inside the mask count.
RegistrationSummary Register(SelectionCloud& cloud, const PosedCamera& view,
                             const View* training_view, const Mask& mask, const DepthMap& depth,
                             const Reconstruction& reconstruction,
                             const RegistrationOptions& options);

}  // namespace retint
