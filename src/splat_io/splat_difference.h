// SPDX-License-Identifier: BSD-3-Clause
// How much a format changes a scene: compares the written file, read back, with the scene before.
#pragma once

#include <cstdint>
#include <span>

#include "scene/gaussian_model.h"

namespace retint {

struct SplatDifference {
  double position_max = 0, position_rms = 0;  // distance of means, world units
  // The largest channel difference of a Gaussian's color from 14 directions, clamped to [0, 1].
  // View- dependent bands that a format drops count too.
  double color_max = 0, color_rms = 0;
  double opacity_max = 0;      // of [0, 1]
  double scale_ratio_max = 1;  // of an axis, longer over shorter, so at least 1
};

// Gaussian g of `after` is Gaussian order[g] of `before`, or g if `order` is empty. Degrees may
// differ, the numbers of Gaussians must not.
SplatDifference Compare(const GaussianModel& before, const GaussianModel& after,
                        std::span<const uint32_t> order = {});

}  // namespace retint
