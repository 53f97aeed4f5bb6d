// SPDX-License-Identifier: BSD-3-Clause
// A COLMAP workspace as COLMAP and 3DGS lay it out: a sparse model, photos, maybe dense depth maps.
//
//   ROOT/sparse/0, ROOT/sparse, ROOT, ROOT/0    cameras, images, points3D (.bin or .txt)
//   ROOT/images                                 photos, by the image names of the model
//   ROOT/stereo/depth_maps                      <image name>.geometric.bin, .photometric.bin
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "scene/image.h"
#include "scene/reconstruction.h"

namespace retint {

// The folder of the sparse model below (or at) `root`, in the order above; nullopt for none.
std::optional<std::filesystem::path> FindModel(const std::filesystem::path& root);

struct Workspace {
  std::filesystem::path root;
  std::filesystem::path sparse_folder;     // where the model was found
  std::filesystem::path image_folder;      // may not exist: photos are needed only when read
  std::filesystem::path depth_map_folder;  // empty where there is none
  Reconstruction reconstruction;
  std::vector<std::string> warnings;  // one line each, for the user

  // `image_folder`, when given, must exist; else ROOT/images, or for a root that is itself the
  // sparse folder the nearest `images` beside or above it. InputError when there is no model or it
  // has no views; see ReadReconstruction for damaged files.
  static Workspace Open(const std::filesystem::path& root,
                        const std::filesystem::path& image_folder = {});

  // InputError with the nearest names when there is no such view.
  const View& RequireView(std::string_view name) const;

  // InputError, one line with the `colmap image_undistorter` command that helps, when a view's
  // camera is neither PINHOLE nor SIMPLE_PINHOLE. Whatever renders calls this first.
  void RequirePinhole() const;

  std::filesystem::path PhotoPath(const View& view) const;
  bool HasPhoto(const View& view) const;
  // InputError when it is missing, damaged, or not of its camera's size.
  Image ReadPhoto(const View& view) const;

  // The view's dense depth map, geometric before photometric; nullopt where there is none.
  std::optional<std::filesystem::path> FindDepthMap(const View& view) const;
};

}  // namespace retint
