// SPDX-License-Identifier: BSD-3-Clause
// A synthetic scene as a COLMAP workspace on disk, with its truth beside it.
//
//   sparse/0/{cameras,images,points3D}.bin   images/<name>   splat.ply
//   masks/<name>.png                 one brush mask to start from
//   truth/depth/<name>.bin           exact depth, COLMAP's format
//   truth/objects/<name>.png         object id of each pixel; truth/objects.txt names them
//   truth/masks/<object>/<name>.png  each selectable object's mask in every view
#pragma once

#include <filesystem>
#include <string>

#include "base/monitor.h"
#include "synthetic/synthetic_scene.h"

namespace retint {

// A view to start recoloring with, which sees the object whole, and its mask.
struct SyntheticStart {
  std::string object, view;
  std::filesystem::path mask;  // relative to the workspace
};

// RunError when it cannot be written. Files that are there are replaced, others left alone.
SyntheticStart WriteSyntheticWorkspace(const std::filesystem::path& folder,
                                       const SyntheticScene& scene, Monitor& monitor);

}  // namespace retint
