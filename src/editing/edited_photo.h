// SPDX-License-Identifier: BSD-3-Clause
// Applies regions' edits to a picture, or to a photo at its full size and in its own lens.
#pragma once

#include "editing/region.h"
#include "opening/open_scene.h"
#include "opening/pictures.h"
#include "recolor/color_edit.h"
#include "scene/camera.h"
#include "scene/image.h"

namespace retint {

// Applies `edit` to `picture`, seen by `camera`, weighted by `mask`; of one size. Not clamped.
void ApplyEdit(OpenScene& scene, const Region& region, const ColorEdit& edit,
               const PosedCamera& camera, const Mask& mask, Image& picture);

// Whether a visible region has a pixel of it, however faint.
bool IsEdited(const RegionSet& regions, const UserPicture& picture);

// Every visible region's edit over the photo of `picture`, which may be larger or smaller than its
// camera says: the masks are scaled to it. In a distorted photo the masks are bent, the photo is
// not; paint (PaintCarrier) is carried on the pinhole views, and its change is bent. Not clamped;
// pixels outside all masks keep their bits.
Image EditedPhoto(OpenScene& scene, const RegionSet& regions, const UserPicture& picture,
                  Image photo);

}  // namespace retint
