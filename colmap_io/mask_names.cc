// SPDX-License-Identifier: BSD-3-Clause
#include "colmap_io/mask_names.h"

#include <algorithm>
#include <string>

#include "base/error.h"
#include "base/files.h"
#include "base/option_name.h"
#include "colmap_io/image_io.h"

namespace retint {

MaskNames MaskNamesOf(std::string_view text) {
  const auto found = std::find(kMaskNames.begin(), kMaskNames.end(), text);
  CheckOption(found != kMaskNames.end(),
              OptionName("mask_names") + " is one of colmap, stem, mask and metashape");
  return static_cast<MaskNames>(found - kMaskNames.begin());
}

std::filesystem::path MaskFile(const std::filesystem::path& folder, std::string_view image_name,
                               MaskNames names) {
  if (names == MaskNames::kColmap) return ViewFile(folder, image_name);
  const char* const suffix = names == MaskNames::kStem   ? ".png"
                             : names == MaskNames::kMask ? ".mask.png"
                                                         : "_mask.png";
  return ViewFile(folder, std::filesystem::path(image_name).replace_extension().string(), suffix);
}

std::optional<std::filesystem::path> FindMask(const std::filesystem::path& folder,
                                              std::string_view image_name) {
  for (size_t k = 0; k < kMaskNames.size(); ++k) {
    std::filesystem::path path = MaskFile(folder, image_name, static_cast<MaskNames>(k));
    if (IsFile(path)) return path;
  }
  return std::nullopt;
}

std::map<std::string, std::filesystem::path> FindMasks(
    const std::filesystem::path& folder, const std::vector<std::string>& image_names) {
  if (!IsFolder(folder)) throw InputError(folder, "is not a folder");
  std::map<std::string, std::filesystem::path> found;
  std::map<std::filesystem::path, std::string> image_of;
  for (const std::string& name : image_names) {
    const auto path = FindMask(folder, name);
    if (!path) continue;
    const auto [other, is_new] = image_of.emplace(*path, name);
    if (!is_new && other->second != name) {
      throw InputError(*path, "would be the mask of " + other->second + " and of " + name +
                                  ": name masks as COLMAP does, e.g. " +
                                  ViewFile("", name).string());
    }
    found.emplace(name, *path);
  }
  if (!found.empty()) return found;
  std::string expected;
  for (size_t k = 0; k < kMaskNames.size() && !image_names.empty(); ++k) {
    const char* const before = k == 0 ? "; expected e.g. " : k == 3 ? " or " : ", ";
    expected += before + MaskFile("", image_names.front(), static_cast<MaskNames>(k)).string();
  }
  throw InputError(folder, "holds no mask of any view" + expected);
}

}  // namespace retint
