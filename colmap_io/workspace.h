// SPDX-License-Identifier: BSD-3-Clause
// Workspaces as COLMAP, 3DGS and nerfstudio lay them out: a sparse model, photos, maybe dense depth
// maps. Below (or at) the root:
//
//   sparse/N, sparse, ., N, colmap/sparse/N, colmap/sparse   cameras, images, points3D (.bin, .txt)
//   dense/N/sparse, dense/sparse, undistorted/sparse         the same, undistorted
//   transforms.json                                          nerfstudio's cameras
//   images, images_2, images_4, images_8, input              photos, by the model's image names
//   stereo/depth_maps                                        <image name>.geometric.bin,
//                                                            .photometric.bin
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "colmap_io/photo_pixels.h"
#include "scene/image.h"
#include "scene/reconstruction.h"

namespace retint {

// The folders below (or at) `root` that hold a sparse model, in the order of the places above.
// Those of the first place that has any begin with the one with most views. A folder that holds
// transforms.json and no COLMAP model counts as one, after all others.
std::vector<std::filesystem::path> FindModels(const std::filesystem::path& root);
// The first of them; nullopt for none.
std::optional<std::filesystem::path> FindModel(const std::filesystem::path& root);

struct Workspace {
  std::filesystem::path root;
  std::filesystem::path sparse_folder;     // where the model was found
  std::filesystem::path image_folder;      // may not exist: photos are needed only when read
  std::filesystem::path depth_map_folder;  // empty if there is none
  Reconstruction reconstruction;
  // Of the numbers in dense depth maps to the reconstruction's unit.
  double depth_scale = 1;
  // Its views were placed around a splat (opening/virtual_views.h): there never were
  // photos.
  bool has_virtual_views = false;
  std::shared_ptr<const PhotoPixels> photo_pixels;  // null where every view shows its own photo's
  std::vector<std::string> warnings;                // one line each, for the user
  // The names that several photos of the model have, without folders and extensions.
  std::set<std::string, std::less<>> shared_stems;

  // `image_folder`, if given, must exist. Else the photos are in the nearest folder with a name as
  // above that holds a photo of the model; of several, in that with the cameras' own size. `model`
  // chooses one of FindModels() by its path below the root or the end of it ("1", "dense/0").
  // Without it, it is the first, or a later one if only that has photos. InputError if there is no
  // such model or it has no views; see ReadReconstruction for damaged files.
  static Workspace Open(const std::filesystem::path& root,
                        const std::filesystem::path& image_folder = {},
                        const std::string& model = {});

  // Moves poses, points and the unit of the depth maps: x_in_new = new_from_old * x_in_old.
  void Transform(const Sim3d& new_from_old);

  // InputError with the nearest names when there is no such view.
  const View& RequireView(std::string_view name) const;

  // Replaces the views of distorted cameras by pinhole ones, whose photos are undistorted as they
  // are read (colmap_io/photo_pixels.h). Whatever renders calls this first; pinhole views stay as
  // they are, also of other models without distortion. InputError, one line that names the camera,
  // for one that cannot be undistorted.
  void UndistortViews();
  // The photo that a view shows a part of, or all; null for a view that shows its photo's own
  // pixels.
  const DistortedPhoto* PhotoOf(const View& view) const;
  // The photo's image name, and the camera of its own pixels.
  const std::string& PhotoName(const View& view) const;
  const Camera& PhotoCamera(const View& view) const;

  // The files of the model, and the photos that are there.
  std::vector<std::filesystem::path> Files() const;

  // The photo's file: by the view's name or, where that is missing, with another extension or
  // without the folders in the name.
  std::filesystem::path PhotoPath(const View& view) const;
  bool HasPhoto(const View& view) const;
  // In the view's pixels. It is read at its camera's size: a photo of another size but the same
  // shape is scaled. Its pixels are used as stored, as in COLMAP. Only if they do not have the
  // camera's shape, and the photo's EXIF says that it must be turned, it is turned. InputError if
  // the photo is missing, damaged or of another shape.
  Image ReadPhoto(const View& view) const;

  // The view's dense depth map, geometric before photometric; nullopt if there is none.
  std::optional<std::filesystem::path> FindDepthMap(const View& view) const;
};

}  // namespace retint
