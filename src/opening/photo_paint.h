// SPDX-License-Identifier: BSD-3-Clause
// Paint in a photo's own pixels. A PaintedView with a distorted camera is on the workspace's photo
// of its name; depth, clouds and masks are of the pinhole views that show that photo.
#pragma once

#include <string>
#include <vector>

#include "colmap_io/workspace.h"
#include "opening/pictures.h"
#include "selection/mask_projector.h"

namespace retint {

// The camera of the photo's own pixels, where it was taken.
PosedCamera PosedPhoto(const Workspace& workspace, const DistortedPhoto& photo);
// The camera of a picture's pixels: the photo's, or its only view's.
PosedCamera PosedPicture(const Workspace& workspace, const UserPicture& picture);

inline bool IsOnPhoto(const PaintedView& painted) { return !painted.camera.camera.IsPinhole(); }
// The views that show the painted picture: itself, unless it is a photo. InputError when the
// workspace has no photo of that name and size. The same for the next function.
std::vector<std::string> PaintedNames(const Workspace& workspace, const PaintedView& painted);

// The mask as each of these views has it, with `seen` limited to the photo. A mask that is not on a
// photo is returned as it is.
std::vector<PaintedView> OnViews(const Workspace& workspace, const PaintedView& painted);
// And of several. Of a photo that takes several views, those that are painted nowhere are left out,
// unless all are.
std::vector<PaintedView> OnViews(const Workspace& workspace,
                                 const std::vector<PaintedView>& painted);
// Back: masks of each of the views as one in the pixels of the painted picture.
Mask FromViews(const Workspace& workspace, const PaintedView& painted, std::vector<Mask> on_views);

}  // namespace retint
