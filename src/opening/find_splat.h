// SPDX-License-Identifier: BSD-3-Clause
// The splats in a workspace's folder.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

namespace retint {

// Splat files of a folder, sorted by name, without hidden ones.
std::vector<std::filesystem::path> SplatsIn(const std::filesystem::path& folder);

// The splat that belongs to a workspace by its place and name: `splat.*` in the folder, else the
// only splat file in it, else `point_cloud` of the newest of point_cloud/iteration_*, where 3DGS
// training code leaves it. Extensions are those of the splat formats that can be read.
std::optional<std::filesystem::path> FindSplat(const std::filesystem::path& workspace);

}  // namespace retint
