// SPDX-License-Identifier: BSD-3-Clause
// Measures what "make it this color" needs to know of a region. Internal to session.
#pragma once

#include <span>

#include "recolor/color_edit.h"
#include "render/renderer.h"
#include "scene/reconstruction.h"
#include "session/region.h"

namespace retint {

// `edit` with the main colors that it waits for: of the pixels that were painted, or where the
// masks came from elsewhere, of up to eight views that they show in, as the coefficients `sh`
// [N, K, 3] render them; after the operations before it in the list. InputError when the selection
// has no pixel in any of them.
ColorEdit WithMainColors(ColorEdit edit, const RegionSelection& selection,
                         const Reconstruction& model, Renderer& renderer,
                         std::span<const float> sh);

}  // namespace retint
