// SPDX-License-Identifier: BSD-3-Clause
// Internal to colmap_io: one file of a sparse model to and from bytes. The readers add to `model`
// and throw InputError with `path` and the offset or line; references are checked in sparse.cc.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "scene/reconstruction.h"

namespace retint::sparse_codec {

using Path = std::filesystem::path;
using Warnings = std::vector<std::string>;

void ReadCamerasBinary(std::string_view bytes, const Path& path, Warnings& warnings,
                       Reconstruction& model);
void ReadImagesBinary(std::string_view bytes, const Path& path, Warnings& warnings,
                      Reconstruction& model);
void ReadPointsBinary(std::string_view bytes, const Path& path, Warnings& warnings,
                      Reconstruction& model);
// Views of the files `rigs` and `frames`, each binary or text by its extension. They have poses but
// no names nor observations: the views are named "image_00042" by their ids.
void ReadRigsAndFrames(const Path& rigs, const Path& frames, Warnings& warnings,
                       Reconstruction& model);
void ReadCamerasText(std::string_view bytes, const Path& path, Warnings& warnings,
                     Reconstruction& model);
void ReadImagesText(std::string_view bytes, const Path& path, Warnings& warnings,
                    Reconstruction& model);
void ReadPointsText(std::string_view bytes, const Path& path, Warnings& warnings,
                    Reconstruction& model);

std::string CamerasToBinary(const Reconstruction& model);
std::string ImagesToBinary(const Reconstruction& model);
std::string PointsToBinary(const Reconstruction& model);
std::string CamerasToText(const Reconstruction& model);
std::string ImagesToText(const Reconstruction& model);
std::string PointsToText(const Reconstruction& model);

// What is wrong with a camera's size or parameters, beyond what the formats themselves can check;
// empty when nothing is.
std::string CameraFault(const Camera& camera, uint64_t width, uint64_t height);
// Normalizes where needed (see ReadReconstruction); false when the quaternion has no direction.
bool NormalizeRotation(Eigen::Quaterniond& rotation);

}  // namespace retint::sparse_codec
