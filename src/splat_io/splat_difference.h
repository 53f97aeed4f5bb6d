// SPDX-License-Identifier: BSD-3-Clause
// How far a format moved a scene: the written file, read back, against the scene before.
#pragma once

#include <cstdint>
#include <span>

#include "scene/gaussian_model.h"

namespace retint {

struct SplatDifference {
  double position_max = 0, position_rms = 0;  // distance of means, world units
  // A Gaussian's color as it is seen from 14 directions, clamped to [0, 1]; its channel that
  // differs most. View-dependent bands that a format drops count too.
  double color_max = 0, color_rms = 0;
  double opacity_max = 0;      // of [0, 1]
  double scale_ratio_max = 1;  // of the longer to the shorter, of an axis, at least 1
};

// `after` holds Gaussian order[g] of `before` at g, or g itself where `order` is empty. Degrees may
// differ. Their numbers of Gaussians must be equal.
SplatDifference Compare(const GaussianModel& before, const GaussianModel& after,
                        std::span<const uint32_t> order = {});

}  // namespace retint
