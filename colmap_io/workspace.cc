// SPDX-License-Identifier: BSD-3-Clause
#include "colmap_io/workspace.h"

#include "base/files.h"
#include "colmap_io/image_io.h"
#include "colmap_io/sparse.h"
#include "scene/image_checks.h"

namespace retint {
namespace {

namespace fs = std::filesystem;

// Beside the model or up to two folders above the root: a root may be the sparse folder itself.
fs::path FindImageFolder(const fs::path& root, bool root_is_sparse) {
  fs::path folder = fs::absolute(root).lexically_normal();
  if (!folder.has_filename()) folder = folder.parent_path();
  std::vector<fs::path> candidates = {root / "images"};
  if (root_is_sparse) {
    candidates.push_back(folder.parent_path() / "images");
    candidates.push_back(folder.parent_path().parent_path() / "images");
  }
  for (const fs::path& candidate : candidates) {
    if (IsFolder(candidate)) return candidate;
  }
  return candidates.front();
}

bool HoldsSeveralModels(const fs::path& sparse_folder) {
  return sparse_folder.filename() == "0" && HasReconstruction(sparse_folder.parent_path() / "1");
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

}  // namespace

std::optional<fs::path> FindModel(const fs::path& root) {
  for (const fs::path& folder : {root / "sparse" / "0", root / "sparse", root, root / "0"}) {
    if (HasReconstruction(folder)) return folder;
  }
  return std::nullopt;
}

Workspace Workspace::Open(const fs::path& root, const fs::path& image_folder) {
  if (!IsFolder(root)) throw InputError(root, IsFile(root) ? "is not a folder" : "no such folder");
  if (!image_folder.empty() && !IsFolder(image_folder)) {
    throw InputError(image_folder, "no such folder of images");
  }
  Workspace workspace;
  workspace.root = root;
  const auto model = FindModel(root);
  if (!model) {
    throw InputError(root,
                     "holds no COLMAP model: no cameras, images and points3D (.bin or .txt) in "
                     "sparse/0, sparse or the folder itself");
  }
  workspace.sparse_folder = *model;
  workspace.image_folder = !image_folder.empty()
                               ? image_folder
                               : FindImageFolder(root, workspace.sparse_folder == root ||
                                                           workspace.sparse_folder == root / "0");
  if (IsFolder(root / "stereo" / "depth_maps")) {
    workspace.depth_map_folder = root / "stereo" / "depth_maps";
  }
  if (HoldsSeveralModels(workspace.sparse_folder)) {
    workspace.warnings.push_back(workspace.sparse_folder.parent_path().string() +
                                 ": holds several models; using 0, the others are ignored");
  }
  std::vector<std::string> warnings;
  workspace.reconstruction = ReadReconstruction(workspace.sparse_folder, &warnings);
  if (workspace.reconstruction.views.empty()) {
    const std::string why = warnings.empty() ? "" : " (" + warnings.front() + ")";
    throw InputError(workspace.sparse_folder, "the model has no usable view" + why);
  }
  workspace.warnings.insert(workspace.warnings.end(), warnings.begin(), warnings.end());
  return workspace;
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

fs::path Workspace::PhotoPath(const View& view) const { return image_folder / view.name; }

bool Workspace::HasPhoto(const View& view) const { return IsFile(PhotoPath(view)); }

Image Workspace::ReadPhoto(const View& view) const {
  const fs::path path = PhotoPath(view);
  Image photo = ReadImage(path);
  const Camera& camera = reconstruction.cameras.at(view.camera_id);
  if (photo.width != camera.width || photo.height != camera.height) {
    throw InputError(path, "photo is " + SizeText(photo.width, photo.height) +
                               ", its camera says " + SizeText(camera.width, camera.height));
  }
  return photo;
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
