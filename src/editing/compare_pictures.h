// SPDX-License-Identifier: BSD-3-Clause
// The changes in pictures of views that a paint program edited.
#pragma once

#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "editing/region.h"
#include "opening/open_scene.h"
#include "recolor/color_edit.h"

namespace retint {

// Reads the pictures of `op` (kPicture) that were not read yet. One in the pixels of a distorted
// photo becomes a picture of each of the views that show it. InputError naming the file when it is
// no picture or not of its view's or photo's size, or when there is no such view.
void ReadPictures(ColorOperation& op, const Workspace& workspace);

// The files that ComparePictures() will read for `op`: its pictures, and the photos that they may
// be of. Nothing where that is done or `op` is no kPicture.
std::vector<std::filesystem::path> FilesCompared(const ColorOperation& op,
                                                 const Workspace& workspace);

// The pixels in which pictures that were read visibly differ from their views. This is the
// selection that was painted with them, by the views' names, as `op` is told. Of paint that no
// color map explains, a little beside it is selected too, for the Gaussians that show it reach
// beyond. A view is rendered with the coefficients `sh` [N, K, 3], or its photo is taken, whichever
// the picture resembles more. InputError for a file in which nothing was changed.
std::map<std::string, Mask> ChangedMasks(ColorOperation& op, OpenScene& scene,
                                         std::span<const float> sh);

// Adds a picture to the operation of `edit` that has them, or one at its end: the newest of a
// picture counts, and `views` show what is in this one. Of earlier pictures nothing is read again.
void AddPicture(ColorEdit& edit, EditedPicture picture, const std::vector<std::string>& views);

// Compares the pictures of `op` with their views inside `selection`, after the operations `before`
// it: fits the color map that explains most of the pixels, keeps it as op.table where it says more
// than that nothing changed, and keeps what it does not explain as layers. Of pictures that were
// compared before, layers stay, and the map too where it explains the new pictures as well as one
// of their own. InputError as ReadPictures, when the selection shows in none of the views, and when
// nothing was changed.
void ComparePictures(ColorOperation& op, const ColorEdit& before, const RegionSelection& selection,
                     OpenScene& scene, std::span<const float> sh);

// The cameras of an edit's layers (PaintCarrier). InputError for a view that there is not.
std::vector<PosedCamera> LayerCameras(const ColorEdit& edit, const Workspace& workspace);

}  // namespace retint
