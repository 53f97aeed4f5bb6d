// SPDX-License-Identifier: BSD-3-Clause
// How well a mask, or a recolored picture, agrees with the truth.
#pragma once

#include <optional>

#include "scene/image.h"

namespace retint {

// Pixels of 128 and more are inside. A figure is empty if it would divide by 0.
struct MaskScore {
  std::optional<double> iou;  // of mask and truth: intersection over union
  // IoU of the pixels of each that lie within a margin of its own border (Boundary IoU, Cheng et
  // al. 2021). A large inside cannot hide errors there. The image's edge counts as a border.
  std::optional<double> boundary_iou;
  std::optional<double> precision;  // part of the mask that is in the truth
  std::optional<double> recall;     // part of the truth that is in the mask
};

// `margin` of the boundary IoU, as a fraction of the image's diagonal; at least one pixel. Mask and
// truth need one size.
MaskScore ScoreMask(const Mask& mask, const Mask& truth, double margin = 0.02);
std::optional<double> Iou(const Mask& mask, const Mask& truth);

// Of a picture that was recolored. Colors are clamped to [0, 1] first, as a screen shows them.
struct EditScore {
  // `hit`: the mean part of the wanted change that arrived, clamped to [0, 1]. For wanted = edited
  // - before, it is (after - before) . wanted / wanted . wanted. `missed`: the fraction of pixels
  // with less than half. Both inside the truth, farther than `border` pixels from its border, if a
  // channel of `wanted` is at least 8 of 255.
  std::optional<double> hit, missed;
  // Outside the truth. `leak`: the mean change of a channel, of 255. `stained`: the fraction of
  // pixels in which a channel changed by more than 8 of 255.
  std::optional<double> leak, stained;
};

// `edited` is `before` with the edit on every pixel. All need one size.
EditScore ScoreEdit(const Image& before, const Image& edited, const Image& after, const Mask& truth,
                    int border = 2);

}  // namespace retint
