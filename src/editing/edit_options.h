// SPDX-License-Identifier: BSD-3-Clause
// All options of an edit, from painted pixels to new coefficients, and presets of them.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "base/option.h"
#include "editing/region.h"
#include "selecting/select_options.h"
#include "selection/mask_projector.h"

namespace retint {

struct EditOptions {
  SelectOptions select;
  ProjectorOptions projector;
  RefitJob refit;
  void Describe(OptionList& list);
  void Check() const;
  void SetSeed(uint64_t seed);  // of everything random
  // For a caller that waits for the end: where a fit would go on until it is stopped (0 iterations
  // of adam), it gets adam's default of steps.
  void EndByThemselves();
};

// "retint", the defaults, and "paper".
std::vector<std::string> Presets();

// OptionError for a name that is none of Presets().
//
// "paper" is ReCoGS as published (STAG 2025). Depth: one rendered pair to the right and one below,
// matched without a choice between sides, the lesser of the two depths, no check by the Gaussians'
// depth, no refinement. Selection: 70 % of the mask's pixels, outliers removed by 16 neighbors and
// a factor of 0.007, no registration; quads of one size on the training views. Fit: to their edited
// photos, by Adam on L1 and D-SSIM from the original coefficients, until it is stopped.
// docs/method.md compares it with Retint.
EditOptions PresetOptions(std::string_view name);

}  // namespace retint
