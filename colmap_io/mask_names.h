// SPDX-License-Identifier: BSD-3-Clause
// The names under which programs look for the mask of a photo.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace retint {

enum class MaskNames {
  kColmap,     // 0001.jpg.png: COLMAP
  kStem,       // 0001.png: brush, LichtFeld Studio
  kMask,       // 0001.mask.png: RealityScan, brush
  kMetashape,  // 0001_mask.png
};
// By their values: "colmap", "stem", "mask", "metashape".
inline constexpr std::array<std::string_view, 4> kMaskNames = {"colmap", "stem", "mask",
                                                               "metashape"};
// OptionError for another text.
MaskNames MaskNamesOf(std::string_view text);

// Where the mask of an image goes; see ViewFile() for its errors.
std::filesystem::path MaskFile(const std::filesystem::path& folder, std::string_view image_name,
                               MaskNames names);
// The existing file with the first of the four names; nullopt if there is no such file.
std::optional<std::filesystem::path> FindMask(const std::filesystem::path& folder,
                                              std::string_view image_name);
// The same of several images, by name; those without one are left out. InputError when `folder` is
// none or holds no mask of any, and when one file would be the mask of two ("a.png" of "a.jpg" and
// of "a.tif").
std::map<std::string, std::filesystem::path> FindMasks(const std::filesystem::path& folder,
                                                       const std::vector<std::string>& image_names);

}  // namespace retint
