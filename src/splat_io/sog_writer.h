// SPDX-License-Identifier: BSD-3-Clause
// The files of a SOG scene made from Gaussians.
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
inline constexpr size_t kSogPaletteColumns = 64;  // sets of coefficients in a row of their picture

// What a scene that was read was packed to: written again, values that an edit left alone keep it.
struct SogTables {
  std::vector<float> bounds;         // of the positions' logarithms: 3 least, 3 most
  std::vector<float> colors, bands;  // 256 numbers each; the latter only above degree 0
  std::vector<uint8_t> palette;      // [count, K - 1, 3], each a number of `bands`
  std::vector<uint8_t> quats;        // [N, 4]

  void Keep(SourceLayout& source) const;
  // Those that Keep() left there; empty for a scene of another format.
  static SogTables Of(const GaussianModel& model);
};

// The quaternion wxyz of a pixel of quats.webp, whose alpha is from 252 on.
std::array<float, 4> DecodeSogQuat(const uint8_t* rgba);

// meta.json and the pictures by their names, Gaussians in `order`. RunError naming `path` for more
// of them than the pictures can hold.
std::map<std::string, std::string> EncodeSog(const GaussianModel& model,
                                             std::span<const uint32_t> order,
                                             const std::filesystem::path& path, Monitor& monitor);

// The files of a scene that was read as `model`, which has other colors since: sh0, shN and their
// parts of meta.json are made anew, pictures of one size with the others; the rest are copies.
std::map<std::string, std::string> RecolorSog(const SogFiles& files, const GaussianModel& model,
                                              const std::filesystem::path& path, Monitor& monitor);

}  // namespace retint
