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

// Adds a picture to the picture operation of `edit`, or to a new one at its end. It replaces those
// of `views`, the views that it shows. Earlier pictures are not read again.
void AddPicture(ColorEdit& edit, EditedPicture picture, const std::vector<std::string>& views);

// Compares the pictures of `op` with their views inside `selection`, after the operations `before`
// it. It fits the color map that explains most of the pixels, and stores it as op.table if that is
// better than no change. The changes that the map does not explain are stored as layers. Layers of
// pictures that were compared before stay. So does the map, if it explains the new pictures as well
// as a map of their own. InputError as ReadPictures, if the selection shows in none of the views,
// and if nothing was changed.
void ComparePictures(ColorOperation& op, const ColorEdit& before, const RegionSelection& selection,
                     OpenScene& scene, std::span<const float> sh);

// The cameras of an edit's layers (PaintCarrier). InputError for a view that there is not.
std::vector<PosedCamera> LayerCameras(const ColorEdit& edit, const Workspace& workspace);

}  // namespace retint
