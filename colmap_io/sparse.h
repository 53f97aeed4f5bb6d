// SPDX-License-Identifier: BSD-3-Clause
// Sparse COLMAP models: cameras, images and points3D, binary or text (COLMAP doc/format.rst).
//
// rigs.* and frames.* (COLMAP >= 3.12) are read only where images.* is missing: images.* keeps
// every image's own cam_from_world, which Retint uses, and its name. They are not written, so a
// model that is read and written again comes out in the older layout, which every COLMAP reads.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "scene/reconstruction.h"

namespace retint {

// Whether `folder` holds any of a model's files (cameras, images or points3D; .bin or .txt).
bool HasReconstruction(const std::filesystem::path& folder);

// Reads the model in `folder`, each part from its .bin or, without one, from its .txt. The result
// is consistent: every view's camera exists, every track element names an existing observation,
// every observation names an existing point or none. Without images.*, views have the poses of
// rigs.* and frames.*, no observations, and names made of their ids. Records left out for that
// (views whose camera is missing, dangling references) are named in `warnings`, one line each. A
// missing points3D is a warning too. Rotations that are not unit quaternions to 1e-9 are
// normalized, others keep their bits. InputError with the file and its offset or line. Causes: a
// missing or truncated file, a count that exceeds the file, an unknown camera model, NaN or
// infinite values, an id or image name that comes twice.
Reconstruction ReadReconstruction(const std::filesystem::path& folder,
                                  std::vector<std::string>* warnings = nullptr);

// Write cameras, images and points3D into `folder`, sorted by id, all three or none of them (a full
// disk leaves the files as they were). Text is COLMAP 3.8's: its comments, 17 significant digits.
// RunError when that fails, or when the folder holds rigs/frames of another model, which COLMAP
// would mix with this one. InputError when an image's name cannot be stored.
void WriteReconstructionBinary(const std::filesystem::path& folder, const Reconstruction& model);
void WriteReconstructionText(const std::filesystem::path& folder, const Reconstruction& model);

}  // namespace retint
