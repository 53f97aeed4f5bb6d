// SPDX-License-Identifier: BSD-3-Clause
// Measures the colors of a region that edits need. Internal.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "colmap_io/workspace.h"
#include "editing/region.h"
#include "opening/open_scene.h"
#include "recolor/color_edit.h"
#include "render/renderer.h"

namespace retint {

// Whether a view with this mask can be measured, and the indices of the views to measure, of
// `count` that can be.
bool IsMeasured(const Mask& mask);
std::vector<size_t> ViewsMeasuredOf(size_t count);

// [P, 3]: the pixels inside the painted masks, as the coefficients `sh` [N, K, 3] render them. If
// the masks came from elsewhere, those of up to eight views that have some. Of each view at most
// some ten thousands.
std::vector<float> PixelsOfSelection(const RegionSelection& selection, const Workspace& workspace,
                                     Renderer& renderer, std::span<const float> sh);

// [P, 3]: those inside the mask of one view, as the renderer shows it. The camera may be that of a
// smaller picture than the mask's.
std::vector<float> PixelsInside(const PosedCamera& camera, const Mask& mask, Renderer& renderer);

// `edit` with its missing values (ColorEdit::NeedsMainColor), measured on those pixels after the
// operations before it in the list. These are main colors, palettes, which keep their number of
// colors, and the comparison of pictures with their views. InputError if the selection has no
// pixel, or not the color that the edit changes; for pictures as ComparePictures.
ColorEdit WithMainColors(ColorEdit edit, const RegionSelection& selection, OpenScene& scene,
                         std::span<const float> sh);
// The same with pixels that are at hand, of an edit without pictures.
ColorEdit WithMainColors(ColorEdit edit, const std::vector<float>& pixels);

}  // namespace retint
