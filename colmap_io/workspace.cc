// SPDX-License-Identifier: BSD-3-Clause
#include "colmap_io/workspace.h"

#include "base/files.h"
#include "colmap_io/layout.h"
#include "colmap_io/nerfstudio.h"
#include "colmap_io/photo.h"
#include "colmap_io/sparse.h"
#include "scene/transform.h"

namespace retint {
namespace {

namespace fs = std::filesystem;

// Of the models in a folder of several, which one was taken.
std::string SeveralModels(const fs::path& sparse_folder) {
  const fs::path folder = sparse_folder.parent_path();
  std::error_code code;
  int models = 0;
  for (auto entry = fs::directory_iterator(folder, code);
       !code && entry != fs::directory_iterator(); entry.increment(code)) {
    const std::string name = entry->path().filename().string();
    const bool number = name.find_first_not_of("0123456789") == std::string::npos;
    models += number && IsFolder(entry->path()) && HasReconstruction(entry->path());
  }
  if (models < 2) return "";
  return folder.string() + ": holds several models; using " + sparse_folder.filename().string() +
         ", the largest; --model takes another";
}

// Single quotes for a POSIX shell, where needed.
std::string Quoted(const std::string& text) {
  constexpr std::string_view kPlain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-./+:@%,=";
  if (!text.empty() && text.find_first_not_of(kPlain) == std::string::npos) return text;
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
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

void Workspace::RequirePinhole() const {
  for (const auto& [id, view] : reconstruction.views) {
    const Camera& camera = reconstruction.cameras.at(view.camera_id);
    if (camera.IsPinhole()) continue;
    fs::path output = fs::absolute(root).lexically_normal();
    if (!output.has_filename()) output = output.parent_path();
    output += "_undistorted";
    throw InputError(
        sparse_folder,
        "camera " + std::to_string(camera.id) + " is " +
            std::string(FindCameraModel(static_cast<int>(camera.model))->name) +
            ", only PINHOLE and SIMPLE_PINHOLE can be rendered; undistort it and use the result: " +
            "colmap image_undistorter --image_path " + Quoted(image_folder.string()) +
            " --input_path " + Quoted(sparse_folder.string()) + " --output_path " +
            Quoted(output.string()));
  }
}

fs::path Workspace::PhotoPath(const View& view) const {
  return FindPhoto(image_folder, view.name).value_or(image_folder / view.name);
}

bool Workspace::HasPhoto(const View& view) const {
  return !has_virtual_views && FindPhoto(image_folder, view.name).has_value();
}

Image Workspace::ReadPhoto(const View& view) const {
  const Camera& camera = reconstruction.cameras.at(view.camera_id);
  return ReadPhotoOfSize(PhotoPath(view), camera.width, camera.height);
}

std::optional<fs::path> Workspace::FindDepthMap(const View& view) const {
  if (depth_map_folder.empty()) return std::nullopt;
  for (const char* kind : {".geometric.bin", ".photometric.bin"}) {
    const fs::path path = depth_map_folder / (view.name + kind);
    if (IsFile(path)) return path;
  }
  return std::nullopt;
}

}  // namespace retint
