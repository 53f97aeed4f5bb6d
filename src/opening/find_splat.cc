// SPDX-License-Identifier: BSD-3-Clause
#include "opening/find_splat.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <string>
#include <string_view>

#include "base/files.h"
#include "splat_io/splat_io.h"

namespace retint {
namespace {

namespace fs = std::filesystem;

// Extensions of formats that mostly hold something else: such a file is no sign of a splat.
bool IsGeneral(std::string_view extension) {
  return extension.ends_with("meta.json") || extension == ".glb" || extension == ".gltf" ||
         extension.starts_with(".usd");
}

// The part of a name before a splat's extension, "splat" of "splat.ply"; empty for other files.
std::string SplatStem(const fs::path& path) {
  const std::string name = path.filename().string();
  std::string lower = name;
  std::transform(lower.begin(), lower.end(), lower.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  std::string stem;
  for (const SplatFormat& format : SplatFormats()) {
    for (const std::string_view extension : format.extensions) {
      if (IsGeneral(extension)) continue;
      const bool longer = stem.empty() || name.size() - extension.size() < stem.size();
      if (lower.ends_with(extension) && lower.size() > extension.size() && longer) {
        stem = name.substr(0, name.size() - extension.size());
      }
    }
  }
  return stem;
}

std::optional<fs::path> NamedSplat(const fs::path& folder, std::string_view stem) {
  for (const fs::path& path : SplatsIn(folder)) {
    if (SplatStem(path) == stem) return path;
  }
  return std::nullopt;
}

std::optional<fs::path> NewestIteration(const fs::path& folder) {
  constexpr std::string_view kPrefix = "iteration_";
  std::optional<fs::path> newest;
  int highest = -1;
  for (const fs::path& path : ListFolder(folder)) {
    const std::string name = path.filename().string();
    int number = -1;
    if (!name.starts_with(kPrefix)) continue;
    std::from_chars(name.data() + kPrefix.size(), name.data() + name.size(), number);
    const auto splat = number > highest ? NamedSplat(path, "point_cloud") : std::nullopt;
    if (!splat) continue;
    highest = number;
    newest = splat;
  }
  return newest;
}

}  // namespace

std::vector<fs::path> SplatsIn(const fs::path& folder) {
  std::vector<fs::path> splats;
  for (const fs::path& path : ListFolder(folder)) {
    const bool hidden = path.filename().string().starts_with('.');
    if (!hidden && IsFile(path) && !SplatStem(path).empty()) splats.push_back(path);
  }
  std::sort(splats.begin(), splats.end());
  return splats;
}

std::optional<fs::path> FindSplat(const fs::path& workspace) {
  if (const auto named = NamedSplat(workspace, "splat")) return named;
  const std::vector<fs::path> splats = SplatsIn(workspace);
  if (splats.size() == 1) return splats.front();
  return NewestIteration(workspace / "point_cloud");
}

}  // namespace retint
