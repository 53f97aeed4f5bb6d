// SPDX-License-Identifier: BSD-3-Clause
// How far paint goes, in the three words that a user chooses by. Each stands for options of the one
// engine (selection/mask_projector.h); none is an engine of its own.
#pragma once

#include <optional>

#include "selection/mask_projector.h"

namespace retint {

// All three: the Gaussians carry the paint by depth, and the painted view's mask is the paint.
enum class PaintReach {
  // completion off, unknown_weight as it is by default: in other views, sides that no painted view
  // sees stay outside. A Gaussian that lies half on the paint may still be in.
  kSurface,
  // completion near: also sides that nobody saw, if they are connected to the paint.
  kObject,
  // completion off, unknown_weight 1: parts that no painted view sees count against the selection
  // as much as parts that one sees beside the paint, and no border moves.
  kExact,
};

void SetReach(PaintReach reach, ProjectorOptions* options);
// None for options that stand for no choice: other projectors, and completion of all that looks
// the same.
std::optional<PaintReach> ReachOf(const ProjectorOptions& options);

}  // namespace retint
