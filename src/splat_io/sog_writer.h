// SPDX-License-Identifier: BSD-3-Clause
// Encodes Gaussians as the files of a SOG scene.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "base/monitor.h"
#include "scene/gaussian_model.h"
#include "splat_io/sog_files.h"

namespace retint {

inline constexpr size_t kSogMostPalette = 65536;
inline constexpr size_t kSogPaletteColumns = 64;  // sets of coefficients per row of their picture

// The packed values of a scene that was read. Values that an edit did not change keep them.
struct SogTables {
  std::vector<float> bounds;         // of the positions' logarithms: 3 least, 3 most
  std::vector<float> colors, bands;  // 256 numbers each; the latter only above degree 0
  std::vector<uint8_t> palette;      // [count, K - 1, 3], indices into `bands`
  std::vector<uint8_t> quats;        // [N, 4]

  void Keep(SourceLayout& source) const;
  // The tables that Keep() stored; empty for a scene of another format.
  static SogTables Of(const GaussianModel& model);
};

// The quaternion wxyz of a pixel of quats.webp, with an alpha of 252 or more.
std::array<float, 4> DecodeSogQuat(const uint8_t* rgba);

// meta.json and the pictures by name, with the Gaussians in `order`. RunError with `path` if the
// pictures cannot hold so many.
std::map<std::string, std::string> EncodeSog(const GaussianModel& model,
                                             std::span<const uint32_t> order,
                                             const std::filesystem::path& path, Monitor& monitor);

// The files of a scene that was read as `model`, with the model's new colors. Makes sh0, shN and
// their parts of meta.json anew, with the same picture sizes, and copies the rest.
std::map<std::string, std::string> RecolorSog(const SogFiles& files, const GaussianModel& model,
                                              const std::filesystem::path& path, Monitor& monitor);

}  // namespace retint
