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

// Whether a mask shows what is measured, and of so many views in whose masks it shows, which of
// them are.
bool IsMeasured(const Mask& mask);
std::vector<size_t> ViewsMeasuredOf(size_t count);

// [P, 3]: the pixels that were painted, or where the masks came from elsewhere, those of up to
// eight views that they show in, as the coefficients `sh` [N, K, 3] render them; of each view at
// most some ten thousands.
std::vector<float> PixelsOfSelection(const RegionSelection& selection, const Workspace& workspace,
                                     Renderer& renderer, std::span<const float> sh);

// [P, 3]: those inside the mask of one view, as the renderer shows it. The camera may be that of a
// smaller picture than the mask's.
std::vector<float> PixelsInside(const PosedCamera& camera, const Mask& mask, Renderer& renderer);

// `edit` with what its operations wait for (ColorEdit::NeedsMainColor), measured on those pixels
// after the operations before it in the list: main colors, palettes, which keep as many colors as
// there are, and the comparison of pictures with their views. InputError when the selection has no
// pixel, or not the color that is to be changed; of pictures as ComparePictures.
ColorEdit WithMainColors(ColorEdit edit, const RegionSelection& selection, OpenScene& scene,
                         std::span<const float> sh);
// The same with pixels that are at hand, of an edit without pictures.
ColorEdit WithMainColors(ColorEdit edit, const std::vector<float>& pixels);

}  // namespace retint
