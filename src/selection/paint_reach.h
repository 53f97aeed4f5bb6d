// SPDX-License-Identifier: BSD-3-Clause
// How far paint reaches, as the three choices of a user. Each stands for options of the same
// projector (selection/mask_projector.h).
#pragma once

#include <optional>

#include "selection/mask_projector.h"

namespace retint {

// For all three, Gaussians carry the paint by depth, and the painted view's mask is its paint.
enum class PaintReach {
  // completion off, default unknown_weight: in other views, sides that no painted view sees stay
  // outside. A Gaussian that is half painted may still be selected.
  kSurface,
  // completion near: also sides that nobody saw, if they are connected to the paint.
  kObject,
  // completion off, unknown_weight 1: parts that no painted view sees count against the selection
  // as much as parts that one sees beside the paint. No border moves.
  kExact,
};

void SetReach(PaintReach reach, ProjectorOptions* options);
// nullopt if the options are none of the choices: another projector, or completion of everything
// that looks the same.
std::optional<PaintReach> ReachOf(const ProjectorOptions& options);

}  // namespace retint
