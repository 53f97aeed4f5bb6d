// SPDX-License-Identifier: BSD-3-Clause
// Internal to colmap_io: where things lie in a workspace (workspace.h lists the places).
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "scene/reconstruction.h"

namespace retint {

// Of FindModels(), the one that --model `name` means. InputError naming all of them otherwise.
std::filesystem::path ChooseModel(const std::filesystem::path& root, const std::string& name);

// The folder of the photos of `model`, which was read from `sparse_folder`: see Workspace::Open().
// nullopt if no folder holds any, and there is no folder named `images`.
std::optional<std::filesystem::path> FindImages(const std::filesystem::path& root,
                                                const std::filesystem::path& sparse_folder,
                                                const Reconstruction& model);

// stereo/depth_maps that belongs to the model; empty if there is no such folder.
std::filesystem::path FindDepthMaps(const std::filesystem::path& root,
                                    const std::filesystem::path& sparse_folder);

// `name` in `folder`; else with another extension, else without the folders in it. nullopt if there
// is no such file.
std::optional<std::filesystem::path> FindPhoto(const std::filesystem::path& folder,
                                               const std::string& name);

}  // namespace retint
