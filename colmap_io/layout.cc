// SPDX-License-Identifier: BSD-3-Clause
#include "colmap_io/layout.h"

#include <algorithm>
#include <charconv>
#include <cstring>
#include <fstream>

#include "base/error.h"
#include "base/files.h"
#include "colmap_io/nerfstudio.h"
#include "colmap_io/photo.h"
#include "colmap_io/sparse.h"
#include "colmap_io/sparse_codec.h"
#include "colmap_io/workspace.h"

namespace retint {
namespace {

namespace fs = std::filesystem;

// As a number, "0", "1", "10"; -1 for other names.
int Number(const std::string& name) {
  int value = -1;
  const auto [end, code] = std::from_chars(name.data(), name.data() + name.size(), value);
  return code == std::errc{} && end == name.data() + name.size() ? value : -1;
}

// Folders of `folder` whose names are numbers, in their order.
std::vector<fs::path> Numbered(const fs::path& folder) {
  std::vector<std::pair<int, fs::path>> found;
  for (const fs::path& path : ListFolder(folder)) {
    const int number = Number(path.filename().string());
    if (number >= 0 && IsFolder(path)) found.emplace_back(number, path);
  }
  std::sort(found.begin(), found.end());
  std::vector<fs::path> folders;
  for (auto& [number, path] : found) folders.push_back(std::move(path));
  return folders;
}

// How many views a model without images.* takes from its rigs.* and frames.*; 0 where they cannot
// be read.
uint64_t CountViewsOfFrames(const fs::path& folder) {
  const auto part = [&](const std::string& name) {
    const fs::path binary = folder / (name + ".bin");
    return IsFile(binary) ? binary : folder / (name + ".txt");
  };
  const fs::path rigs = part("rigs"), frames = part("frames");
  if (!IsFile(rigs) || !IsFile(frames)) return 0;
  try {
    std::vector<std::string> warnings;
    Reconstruction model;
    sparse_codec::ReadRigsAndFrames(rigs, frames, warnings, model);
    return model.views.size();
  } catch (const InputError&) {
    return 0;  // its faults are told where it is opened
  }
}

// How many images a model says it has, without reading its images: of a text model, half its lines
// that are no comments.
uint64_t CountViews(const fs::path& folder) {
  uint64_t count = 0;
  if (std::ifstream binary(folder / "images.bin", std::ios::binary); binary) {
    char bytes[sizeof count];
    if (binary.read(bytes, sizeof bytes)) std::memcpy(&count, bytes, sizeof count);
    return count;
  }
  if (!IsFile(folder / "images.txt")) return CountViewsOfFrames(folder);
  std::ifstream text(folder / "images.txt");
  for (std::string line; std::getline(text, line);) count += !line.starts_with('#');
  return count / 2;
}

// Those of `folders` that hold a model, the one with most views first.
std::vector<fs::path> WithModels(const std::vector<fs::path>& folders) {
  std::vector<fs::path> models;
  std::copy_if(folders.begin(), folders.end(), std::back_inserter(models), HasReconstruction);
  if (models.size() < 2) return models;
  std::vector<std::pair<uint64_t, size_t>> order;
  for (size_t i = 0; i < models.size(); ++i) order.emplace_back(CountViews(models[i]), i);
  std::stable_sort(order.begin(), order.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<fs::path> sorted;
  for (const auto& [views, i] : order) sorted.push_back(models[i]);
  return sorted;
}

fs::path WithoutSlash(const fs::path& path) {
  const fs::path normal = fs::absolute(path).lexically_normal();
  return normal.has_filename() ? normal : normal.parent_path();
}

// Whether `path` ends with the parts of `end`.
bool EndsWith(const fs::path& path, const fs::path& end) {
  const std::vector<fs::path> all(path.begin(), path.end()), tail(end.begin(), end.end());
  return tail.size() <= all.size() && std::equal(tail.rbegin(), tail.rend(), all.rbegin());
}

// Folders that may hold the photos, likeliest first.
std::vector<fs::path> ImageFolders(const fs::path& root, const fs::path& sparse_folder) {
  // The model's own surroundings up to the root's parent's parent: a root may be the sparse folder.
  std::vector<fs::path> places;
  fs::path place = WithoutSlash(sparse_folder);
  const fs::path top = WithoutSlash(root).parent_path().parent_path();
  for (int up = 0; up < 5 && !place.empty(); ++up) {
    places.push_back(place);
    if (place == top || place == place.parent_path()) break;
    place = place.parent_path();
  }
  std::vector<fs::path> folders;
  for (const fs::path& at : places) {
    for (const char* name : {"images", "images_2", "images_4", "images_8", "input", "rgb"}) {
      if (IsFolder(at / name)) folders.push_back(at / name);
    }
    folders.push_back(at);  // photos beside the model, and names that begin with the folder's
  }
  folders.push_back(top.root_path());  // names that were whole paths
  return folders;
}

}  // namespace

std::vector<fs::path> FindModels(const fs::path& root) {
  std::vector<fs::path> found;
  const auto add = [&](const std::vector<fs::path>& folders) {
    for (const fs::path& folder : WithModels(folders)) {
      if (std::find(found.begin(), found.end(), folder) == found.end()) found.push_back(folder);
    }
  };
  add(Numbered(root / "sparse"));
  add({root / "sparse"});
  add({root});
  add(Numbered(root));
  add(Numbered(root / "colmap" / "sparse"));
  add({root / "colmap" / "sparse"});
  std::vector<fs::path> dense;
  for (const fs::path& one : Numbered(root / "dense")) dense.push_back(one / "sparse");
  add(dense);
  add({root / "dense" / "sparse"});
  add({root / "undistorted" / "sparse"});
  if (IsFile(root / kTransformsName)) {
    if (std::find(found.begin(), found.end(), root) == found.end()) found.push_back(root);
  }
  return found;
}

std::optional<fs::path> FindModel(const fs::path& root) {
  const std::vector<fs::path> models = FindModels(root);
  if (models.empty()) return std::nullopt;
  return models.front();
}

fs::path ChooseModel(const fs::path& root, const std::string& name) {
  const std::vector<fs::path> models = FindModels(root);
  const fs::path plain = fs::path(name).lexically_normal();
  const fs::path wanted = plain.has_filename() ? plain : plain.parent_path();  // "sparse/1/"
  std::string names;
  for (const fs::path& model : models) {
    fs::path relative = model.lexically_relative(root);
    if (relative == wanted) return model;
    names += (names.empty() ? "" : ", ") + relative.string();
  }
  for (const fs::path& model : models) {
    // "dense/0" is its folder sparse.
    if (EndsWith(model, wanted) || EndsWith(model, wanted / "sparse")) return model;
  }
  throw InputError(
      root, "holds no sparse model \"" + name + "\"; there is " + (names.empty() ? "none" : names));
}

std::optional<fs::path> FindPhoto(const fs::path& folder, const std::string& name) {
  const fs::path relative(name);
  for (const fs::path& path : {folder / relative, folder / relative.filename()}) {
    if (IsFile(path)) return path;
    for (const char* extension :
         {".jpg", ".png", ".jpeg", ".JPG", ".JPEG", ".PNG", ".tif", ".tiff", ".TIF", ".TIFF",
          ".webp", ".WEBP", ".bmp", ".BMP", ".jp2", ".JP2"}) {
      fs::path other = path;
      if (IsFile(other.replace_extension(extension))) return other;
    }
  }
  return std::nullopt;
}

std::optional<fs::path> FindImages(const fs::path& root, const fs::path& sparse_folder,
                                   const Reconstruction& model) {
  constexpr int kTried = 3;  // views, evenly spread: some photos may be missing
  const std::vector<const View*> views = model.ViewsByName();
  std::optional<fs::path> first;
  for (const fs::path& folder : ImageFolders(root, sparse_folder)) {
    for (size_t k = 0; k < kTried && k < views.size(); ++k) {
      const View& view = *views[k * views.size() / std::min<size_t>(kTried, views.size())];
      const fs::path named = folder / view.name;
      const auto photo = FindPhoto(folder, view.name);
      // Beside the model only whole names count, to which an extension may be missing.
      const bool exact =
          photo && (*photo == named ||
                    (!named.has_extension() && photo->parent_path() == named.parent_path()));
      const std::string name = folder.filename().string();
      if (!photo || (!exact && !name.starts_with("images"))) continue;
      const auto size = ReadImageSize(*photo);
      const Camera& camera = model.cameras.at(view.camera_id);
      if (size && size->first == camera.width && size->second == camera.height) return folder;
      if (!first) first = folder;
      break;
    }
  }
  // If there are no photos, they belong into `images` of the workspace that the root is a part of.
  const bool root_is_model = sparse_folder == root || sparse_folder == root / "0";
  fs::path place = WithoutSlash(root);
  for (int up = 0; !first && root_is_model && up < 3; ++up, place = place.parent_path()) {
    if (IsFolder(place / "images")) first = place / "images";
  }
  return first;
}

fs::path FindDepthMaps(const fs::path& root, const fs::path& sparse_folder) {
  const fs::path sparse = WithoutSlash(sparse_folder);
  for (const fs::path& at : {root, sparse.parent_path(), sparse.parent_path().parent_path()}) {
    if (IsFolder(at / "stereo" / "depth_maps")) return at / "stereo" / "depth_maps";
  }
  return {};
}

}  // namespace retint
