// SPDX-License-Identifier: BSD-3-Clause
#include "session/reporting/score_layout.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <map>
#include <string_view>
#include <system_error>
#include <utility>

#include "base/error.h"
#include "base/files.h"
#include "colmap_io/image_io.h"

namespace retint {
namespace {

namespace fs = std::filesystem;

std::string Lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

// Pictures .png below `folder` by their paths in it without ".png"; hidden ones are left out.
std::map<std::string, fs::path> PngFiles(const fs::path& folder) {
  if (!IsFolder(folder)) throw InputError(folder, "no such folder");
  std::map<std::string, fs::path> files;
  std::error_code error;
  for (auto entry = fs::recursive_directory_iterator(folder, error);
       entry != fs::recursive_directory_iterator(); entry.increment(error)) {
    if (error) break;
    const fs::path& path = entry->path();
    const std::string file = path.filename().string();
    if (file.starts_with('.')) {
      if (entry->is_directory()) entry.disable_recursion_pending();
      continue;
    }
    if (Lower(path.extension().string()) != ".png" || !IsFile(path)) continue;
    const std::string name = path.lexically_relative(folder).generic_string();
    files.emplace(name.substr(0, name.size() - 4), path);
  }
  if (error) throw InputError(folder, "cannot be read: " + error.message());
  return files;
}

std::vector<fs::path> Folders(const fs::path& folder) {
  if (!IsFolder(folder)) throw InputError(folder, "no such folder");
  std::vector<fs::path> folders;
  for (const fs::path& path : ListFolder(folder)) {
    const std::string name = path.filename().string();
    if (IsFolder(path) && !name.starts_with('.') && !name.starts_with("__")) {
      folders.push_back(path);
    }
  }
  std::sort(folders.begin(), folders.end());
  return folders;
}

// "IMG_1" of "IMG_1.JPG" and of "IMG_1".
std::string WithoutPhotoExtension(const std::string& name) {
  const std::string extension = Lower(fs::path(name).extension().string());
  for (const char* const known : {".jpg", ".jpeg", ".png", ".tif", ".tiff", ".bmp", ".webp"}) {
    if (extension == known) return name.substr(0, name.size() - extension.size());
  }
  return name;
}

// The masks of one scene, however their photos were called.
class SceneMasks {
 public:
  explicit SceneMasks(const fs::path& folder) : folder_(folder) {
    for (const auto& [name, path] : PngFiles(folder)) {
      const std::string stem = WithoutPhotoExtension(fs::path(name).filename().string());
      if (!by_stem_.emplace(stem, path).second) {
        throw InputError(path, "another mask of the folder is of a photo " + stem + " too");
      }
      in_order_.push_back(path);
    }
  }

  const fs::path& Of(const std::string& image, TruthLayout layout) const {
    auto found = by_stem_.find(image);
    const bool spin = layout == TruthLayout::kSpinNerf;
    if (spin && found == by_stem_.end() && (image.starts_with("0_") || image.starts_with("1_"))) {
      found = by_stem_.find(image.substr(2));
    }
    if (found != by_stem_.end()) return found->second;
    constexpr std::string_view kIndexed = "image";
    if (spin && image.starts_with(kIndexed)) {
      size_t index = 0;
      const char* const end = image.data() + image.size();
      const auto parsed = std::from_chars(image.data() + kIndexed.size(), end, index);
      if (parsed.ec == std::errc() && parsed.ptr == end && index < in_order_.size()) {
        return in_order_[index];
      }
    }
    throw InputError(folder_, "has no mask of the photo " + image);
  }

 private:
  fs::path folder_;
  std::map<std::string, fs::path> by_stem_;
  std::vector<fs::path> in_order_;  // by name
};

// MASKS/<scene>, or "orchids" for "orchids (llff)"; empty where there is none.
fs::path MaskFolder(const fs::path& masks, const std::string& scene) {
  if (IsFolder(masks / scene)) return masks / scene;
  const size_t end = scene.find(" (");
  if (end != std::string::npos && IsFolder(masks / scene.substr(0, end))) {
    return masks / scene.substr(0, end);
  }
  return {};
}

// Of one scene's folder, the images that have a true mask.
std::map<std::string, fs::path> TrueMasks(const fs::path& folder, TruthLayout layout) {
  std::map<std::string, fs::path> truth;
  for (const auto& [name, path] : PngFiles(folder)) {
    constexpr std::string_view kMask = "_mask";
    if (layout == TruthLayout::kNvos) {
      if (name.ends_with(kMask)) truth.emplace(name.substr(0, name.size() - kMask.size()), path);
    } else if (!name.ends_with("_pseudo") && !name.ends_with("_cutout")) {
      truth.emplace(name, path);
    }
  }
  return truth;
}

void AddScene(const ScoreRequest& request, const fs::path& folder, std::vector<ScoredFile>* files,
              std::vector<std::string>* warnings) {
  const std::string scene = folder.filename().string();
  const auto truth = TrueMasks(folder, request.layout);
  if (truth.empty()) return;
  const fs::path mask_folder = MaskFolder(request.masks, scene);
  if (mask_folder.empty()) {
    warnings->push_back("scene " + scene + " is left out: " + request.masks.string() +
                        " has no folder of its masks");
    return;
  }
  const SceneMasks masks(mask_folder);
  bool first = request.layout == TruthLayout::kSpinNerf;
  for (const auto& [image, path] : truth) {
    const bool given = std::exchange(first, false);
    files->push_back({scene, image, path, masks.Of(image, request.layout), given});
  }
}

}  // namespace

std::vector<ScoredFile> FindScoredFiles(const ScoreRequest& request,
                                        std::vector<std::string>* warnings) {
  std::vector<ScoredFile> files;
  if (request.layout == TruthLayout::kViews) {
    const auto is_painted = [&](const std::string& view) {
      return std::find(request.painted.begin(), request.painted.end(), view) !=
             request.painted.end();
    };
    for (const auto& [view, path] : PngFiles(request.truth)) {
      const fs::path mask = request.masks.empty() ? fs::path() : ViewFile(request.masks, view);
      if (!mask.empty() && !IsFile(mask)) throw InputError(mask, "no such mask");
      files.push_back({"", view, path, mask, is_painted(view)});
    }
  } else {
    const bool nvos = request.layout == TruthLayout::kNvos;
    const bool below = nvos && IsFolder(request.truth / "masks");
    for (const fs::path& folder : Folders(below ? request.truth / "masks" : request.truth)) {
      AddScene(request, folder, &files, warnings);
    }
  }
  if (files.empty()) throw InputError(request.truth, "holds no true mask that could be scored");
  return files;
}

}  // namespace retint
