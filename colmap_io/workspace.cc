// SPDX-License-Identifier: BSD-3-Clause
#include "colmap_io/workspace.h"

#include <algorithm>

#include "base/files.h"
#include "base/option_name.h"
#include "colmap_io/layout.h"
#include "colmap_io/nerfstudio.h"
#include "colmap_io/photo.h"
#include "colmap_io/sparse.h"
#include "scene/camera_projection.h"
#include "scene/transform.h"

namespace retint {
namespace {

namespace fs = std::filesystem;

// Of the models in a folder of several, which one was taken.
std::string SeveralModels(const fs::path& sparse_folder) {
  const fs::path folder = sparse_folder.parent_path();
  int models = 0;
  for (const fs::path& path : ListFolder(folder)) {
    const std::string name = path.filename().string();
    const bool number = name.find_first_not_of("0123456789") == std::string::npos;
    models += number && IsFolder(path) && HasReconstruction(path);
  }
  if (models < 2) return "";
  return folder.string() + ": holds several models; using " + sparse_folder.filename().string() +
         ", the largest; " + OptionName("model") + " takes another";
}

Workspace OpenModel(const fs::path& root, const fs::path& folder, const fs::path& image_folder) {
  Workspace workspace;
  workspace.root = root;
  workspace.sparse_folder = folder;
  std::vector<std::string>& warnings = workspace.warnings;
  workspace.reconstruction = HasReconstruction(folder)
                                 ? ReadReconstruction(folder, &warnings)
                                 : ReadTransforms(folder / kTransformsName, &warnings);
  if (workspace.reconstruction.views.empty()) {
    const std::string why = warnings.empty() ? "" : " (" + warnings.front() + ")";
    throw InputError(folder, "the model has no usable view" + why);
  }
  workspace.image_folder = image_folder;
  if (image_folder.empty()) {
    const auto found = FindImages(root, folder, workspace.reconstruction);
    workspace.image_folder = found.value_or(root / "images");
  }
  workspace.depth_map_folder = FindDepthMaps(root, folder);
  return workspace;
}

// "0001" of "left/0001.jpg".
std::string_view Stem(std::string_view name) {
  name.remove_prefix(name.rfind('/') + 1);
  return name.substr(0, name.rfind('.'));
}

// Without the folders in its name a file is a view's photo where it cannot be another view's.
std::optional<fs::path> PhotoNamed(const std::string& name, const Workspace& workspace) {
  const auto found = FindPhoto(workspace.image_folder, name);
  if (!found || found->parent_path() == (workspace.image_folder / name).parent_path()) {
    return found;
  }
  return workspace.shared_stems.contains(Stem(name)) ? std::nullopt : found;
}

std::set<std::string, std::less<>> SharedStems(const Reconstruction& model) {
  std::set<std::string, std::less<>> once, shared;
  for (const auto& [id, view] : model.views) {
    std::string stem(Stem(view.name));
    if (!once.insert(stem).second) shared.insert(std::move(stem));
  }
  return shared;
}

}  // namespace

Workspace Workspace::Open(const fs::path& root, const fs::path& image_folder,
                          const std::string& model) {
  if (!IsFolder(root)) throw InputError(root, IsFile(root) ? "is not a folder" : "no such folder");
  if (!image_folder.empty() && !IsFolder(image_folder)) {
    throw InputError(image_folder, "no such folder of images");
  }
  const std::vector<fs::path> models =
      model.empty() ? FindModels(root) : std::vector<fs::path>{ChooseModel(root, model)};
  if (models.empty()) {
    throw InputError(root,
                     "holds no COLMAP model: no cameras, images and points3D (.bin or .txt) in "
                     "sparse/0, sparse, dense/0 or the folder itself, and no transforms.json");
  }
  Workspace workspace = OpenModel(root, models.front(), image_folder);
  // Another model may be the one that the photos belong to: `colmap automatic_reconstructor`
  // leaves undistorted ones with a model of their own in dense/0.
  for (size_t i = 1; i < models.size() && !IsFolder(workspace.image_folder); ++i) {
    try {
      Workspace other = OpenModel(root, models[i], image_folder);
      if (IsFolder(other.image_folder)) workspace = std::move(other);
    } catch (const InputError&) {
      continue;  // the first one can be used, without photos
    }
  }
  workspace.shared_stems = SharedStems(workspace.reconstruction);
  if (model.empty()) {
    const std::string several = SeveralModels(workspace.sparse_folder);
    if (!several.empty()) workspace.warnings.insert(workspace.warnings.begin(), several);
  }
  return workspace;
}

void Workspace::Transform(const Sim3d& new_from_old) {
  retint::Transform(new_from_old, reconstruction);
  depth_scale *= new_from_old.scale;
}

const View& Workspace::RequireView(std::string_view name) const {
  if (const View* view = reconstruction.FindView(name)) return *view;
  std::string fault = "no view is named \"" + std::string(name) + "\"; nearest: ";
  const char* separator = "";
  for (const std::string& near : reconstruction.NearestNames(name)) {
    fault += separator + near;
    separator = ", ";
  }
  throw InputError(sparse_folder, fault);
}

void Workspace::UndistortViews() {
  const auto is_pinhole = [&](const auto& entry) {
    return reconstruction.cameras.at(entry.second.camera_id).IsPinhole();
  };
  const auto& views = reconstruction.views;
  for (auto& [id, camera] : reconstruction.cameras) camera = WithoutZeroDistortion(camera);
  if (std::all_of(views.begin(), views.end(), is_pinhole)) return;
  try {
    photo_pixels = std::make_shared<const PhotoPixels>(&reconstruction);
  } catch (const InputError& error) {
    throw InputError(sparse_folder, error.what());
  }
}

const DistortedPhoto* Workspace::PhotoOf(const View& view) const {
  return photo_pixels ? photo_pixels->PhotoOf(view.id) : nullptr;
}

const std::string& Workspace::PhotoName(const View& view) const {
  const DistortedPhoto* photo = PhotoOf(view);
  return photo ? photo->name : view.name;
}

const Camera& Workspace::PhotoCamera(const View& view) const {
  const DistortedPhoto* photo = PhotoOf(view);
  return photo ? photo->lens->photo : reconstruction.cameras.at(view.camera_id);
}

std::vector<fs::path> Workspace::Files() const {
  static const std::set<std::string> parts = {"cameras", "images", "points3D",
                                              "rigs",    "frames", "transforms"};
  std::vector<fs::path> files;
  for (const fs::path& path : ListFolder(sparse_folder)) {
    if (parts.contains(path.stem().string()) && IsFile(path)) files.push_back(path);
  }
  std::set<std::string_view> seen;  // several views may show one photo
  for (const auto& [id, view] : reconstruction.views) {
    const std::string& name = PhotoName(view);
    if (has_virtual_views || !seen.insert(name).second) continue;
    if (auto photo = PhotoNamed(name, *this)) files.push_back(std::move(*photo));
  }
  return files;
}

fs::path Workspace::PhotoPath(const View& view) const {
  const std::string& name = PhotoName(view);
  return PhotoNamed(name, *this).value_or(image_folder / name);
}

bool Workspace::HasPhoto(const View& view) const {
  return !has_virtual_views && PhotoNamed(PhotoName(view), *this).has_value();
}

Image Workspace::ReadPhoto(const View& view) const {
  const Camera& camera = PhotoCamera(view);
  Image photo = ReadPhotoOfSize(PhotoPath(view), camera.width, camera.height);
  if (PhotoOf(view)) return photo_pixels->ToView(view.id, photo);
  return photo;
}

std::optional<fs::path> Workspace::FindDepthMap(const View& view) const {
  // COLMAP's dense maps are of undistorted photos.
  if (depth_map_folder.empty() || PhotoOf(view)) return std::nullopt;
  for (const char* kind : {".geometric.bin", ".photometric.bin"}) {
    const fs::path path = depth_map_folder / (view.name + kind);
    if (IsFile(path)) return path;
  }
  return std::nullopt;
}

}  // namespace retint
