// SPDX-License-Identifier: BSD-3-Clause
// The splats in a workspace's folder.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

namespace retint {

// Splat files of a folder, sorted by name, without hidden ones.
std::vector<std::filesystem::path> SplatsIn(const std::filesystem::path& folder);

// The splat that belongs to a workspace: `splat.*` in the folder, else the only splat file in it.
// Else it is `point_cloud` of the newest point_cloud/iteration_*, where 3DGS training code writes
// it. Extensions are those of the splat formats that can be read.
std::optional<std::filesystem::path> FindSplat(const std::filesystem::path& workspace);

}  // namespace retint
