// SPDX-License-Identifier: BSD-3-Clause
// How well a mask, or a recolored picture, agrees with the truth.
#pragma once

#include <optional>

#include "scene/image.h"

namespace retint {

// Pixels of 128 and more are inside. A figure is empty where it would divide by nothing.
struct MaskScore {
  std::optional<double> iou;  // of mask and truth: intersection over union
  // IoU of the pixels of each that lie within a margin of its own border (Cheng et al. 2021,
  // Boundary IoU): errors that a large inside would hide. The image's edge is a border too.
  std::optional<double> boundary_iou;
  std::optional<double> precision;  // share of the mask that is true
  std::optional<double> recall;     // share of the truth that the mask has
};

// `margin`: of the boundary IoU, as a fraction of the image's diagonal; at least one pixel. Both
// have one size.
MaskScore ScoreMask(const Mask& mask, const Mask& truth, double margin = 0.02);
std::optional<double> Iou(const Mask& mask, const Mask& truth);

// Of a picture that was recolored. Colors are clamped to [0, 1] first, as a screen shows them.
struct EditScore {
  // Inside the truth, `border` pixels from its border: the mean share of the requested change that
  // arrived, (after - before) . wanted / wanted . wanted with wanted = edited - before, in [0, 1];
  // and the share of those pixels in which less than half did. Pixels of which no channel was to
  // change by 8 of 255 steps do not count.
  std::optional<double> hit, missed;
  // Outside the truth: the mean change of a channel in steps of 255, and the share of the pixels of
  // which a channel changed by more than 8.
  std::optional<double> leak, stained;
};

// `edited` is `before` with the whole edit on every pixel. All have one size.
EditScore ScoreEdit(const Image& before, const Image& edited, const Image& after, const Mask& truth,
                    int border = 2);

}  // namespace retint
