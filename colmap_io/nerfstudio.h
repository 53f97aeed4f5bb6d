// SPDX-License-Identifier: BSD-3-Clause
// nerfstudio's transforms.json: cameras and poses without a COLMAP model, with COLMAP's or OpenGL's
// axes (docs.nerf.studio, "Data conventions").
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "scene/reconstruction.h"
#include "scene/rigid3d.h"

namespace retint {

inline constexpr const char* kTransformsName = "transforms.json";

// Views are named by their file_path, without parts that lead out of the folder ("..", the root).
// Its transform_matrix is world_from_camera of a camera with x right, y up and z backward; the
// result has COLMAP's axes. If the file has applied_transform, the world is the one before it:
// COLMAP's. Points are those of the .ply that ply_file_path names, in the same frame as the poses;
// no view is known to see them. InputError for a file that cannot be used; points that cannot be
// read are a warning.
Reconstruction ReadTransforms(const std::filesystem::path& path,
                              std::vector<std::string>* warnings);

// A similarity from a file. nerfstudio's dataparser_transforms.json {"transform": 3x4, "scale"}
// goes from the data's world to the splat's. {"world_from_splat": 3x4, 4x4, or the 12 or 16 numbers
// by rows} goes the other way round. The result is world_from_splat of either. InputError if the
// file holds neither, or a matrix that is not a similarity.
Sim3d ReadWorldFromSplat(const std::filesystem::path& path);
// The same out of 12 or 16 numbers between blanks or commas, a matrix by rows. OptionError.
Sim3d ParseWorldFromSplat(const std::string& text);
// Of either kind: a file's if `text` is the name of one.
Sim3d WorldFromSplatOf(const std::string& text);
// Exactly: no scale, rotation or translation.
bool IsIdentity(const Sim3d& similarity);
// The 12 numbers, as ParseWorldFromSplat() reads them; with every digit.
std::string WorldFromSplatToText(const Sim3d& world_from_splat);
// {"world_from_splat": 4x4}, as ReadWorldFromSplat() reads it.
std::string WorldFromSplatToJson(const Sim3d& world_from_splat);

}  // namespace retint
