// SPDX-License-Identifier: BSD-3-Clause
#include "selection/paint_reach.h"

namespace retint {

void SetReach(PaintReach reach, ProjectorOptions* options) {
  options->kind = ProjectorKind::kGaussians;
  options->completion = reach == PaintReach::kObject ? Completion::kNear : Completion::kOff;
  options->unknown_weight = reach == PaintReach::kExact ? 1 : ProjectorOptions().unknown_weight;
}

std::optional<PaintReach> ReachOf(const ProjectorOptions& options) {
  if (options.kind != ProjectorKind::kGaussians || options.completion == Completion::kAll) {
    return std::nullopt;
  }
  if (options.completion == Completion::kNear) return PaintReach::kObject;
  return options.unknown_weight < 1 ? PaintReach::kSurface : PaintReach::kExact;
}

}  // namespace retint
