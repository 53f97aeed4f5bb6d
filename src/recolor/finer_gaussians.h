// SPDX-License-Identifier: BSD-3-Clause
// Large Gaussians as many small ones that look the same together, so that an edit can show detail
// where the splat has none: stripes or letters on a plain wall.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/monitor.h"
#include "base/option.h"
#include "recolor/sh_refitter.h"
#include "render/renderer.h"
#include "scene/gaussian_model.h"

namespace retint {

struct FinerGaussians {
  GaussianModel model;           // first those that stay, in their order and with all their bits
  std::vector<int32_t> parents;  // [M] of each of them, its own or its parent's index before
  size_t stayed = 0;
};

// Of the parts of a Gaussian, in the world's unit.
struct PartSize {
  float deviation = 0;  // standard deviation; 0: the Gaussian stays
  float blur = 0;       // by how much of a deviation renderers widen it where it is seen
};

// `parents` as FinerGaussians has them: every row is its parent's, which is all that a part has
// until its place, size, opacity and colors are set.
FinerGaussians CopyParents(const GaussianModel& model, std::vector<int32_t> parents, size_t stayed);

// Splits Gaussians along those of their axes that are longer than their `sizes`, [N], each
// into at most 4096 parts. If more are needed, parts are larger. Along an axis of deviation
// s, a Gaussian of variance s^2 is the convolution of one of variance s^2 - size^2 with one
// of size^2. The first is sampled, 1.8 sizes apart. Multiplicative updates of optical depths
// then find opacities with which the parts let as much light through as their parent did.
// This considers that renderers widen each part, and small ones the most. Parts have their
// parent's colors. A faint Gaussian stays whole: its parts would be fainter than renderers
// draw.
FinerGaussians SplitGaussians(const GaussianModel& model, std::span<const PartSize> sizes);

struct RefineOptions {
  double pixels = 1.2;  // standard deviation of the parts, in the pixels of the closest view
  int most = 300000;    // the largest number of parts; if more are needed, parts are larger
  double share = 0.5;   // of a Gaussian inside the masks, above which it is split
  void Describe(OptionList& list);
  void Check() const;
};

struct RefineSummary {
  size_t before = 0, split = 0;     // Gaussians that there were, and those that were split
  size_t parts = 0;                 // the parts of these
  double pixels = 0;                // the parts' size that was taken
  double psnr_split = 0, psnr = 0;  // of the views inside the masks against the original's, dB:
                                    // with the parents' colors, and with the parts' own
  // For people. The warning is empty where all went as it was asked for.
  std::string BriefReport() const;
  std::string Warning(const RefineOptions& asked) const;
};

struct Refinement {
  FinerGaussians finer;
  RefineSummary summary;
};

// Splits the Gaussians inside the masks of `targets`, whose photos do not count. It fits the parts'
// colors to `renderer`'s view of `model` there, so that the scene looks as before. All other data
// keep their bits. `shares` as ShRefitter has them; OptionError and InputError as there. Stages:
// "refine", and ShRefitter's.
Refinement RefineGaussians(Renderer& renderer, const GaussianModel& model,
                           std::vector<RefitTarget> targets, std::vector<float> shares,
                           const RefineOptions& options, Monitor& monitor);

}  // namespace retint
