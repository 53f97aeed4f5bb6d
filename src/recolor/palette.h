// SPDX-License-Identifier: BSD-3-Clause
// The main colors of a region: the centers of its pixels' clusters.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace retint {

inline constexpr int kMaxPaletteColors = 16;
// Lightness counts so much of a difference in saturation (PaletteCoordinates): shading does not
// split a surface into several colors. For finding a palette and for the weights of editing one.
inline constexpr float kPaletteLightnessWeight = 0.25f;
// In that distance: colors nearer to each other are shades of one, unless together they spread
// farther about their mean (mean distance).
inline constexpr float kPaletteSeparation = 0.15f, kPaletteSpread = 0.0445f;

struct PaletteColor {
  std::array<float, 3> rgb = {};  // display-encoded, 0 to 1
  float share = 0;                // of the pixels that are nearest to it
  bool operator==(const PaletteColor&) const = default;
};

// Up to `count` (1 to kMaxPaletteColors) main colors of `pixels`, [N, 3], display-encoded. They
// come from k-means of PaletteCoordinates (Lloyd 1982) with many clusters, the best of several
// seeded starts (Arthur and Vassilvitskii 2007). Clusters that are shades of one color become one,
// and rare ones join others until `count` are left. A color is the median of its pixels, so that
// blends at edges do not move it. Most frequent first. There are fewer if the pixels have fewer
// different colors, and an edit of one then changes a range of colors that is wide enough for a
// fit. There is none without pixels. The same pixels and seed give the same bits. OptionError for a
// count out of range.
std::vector<PaletteColor> FindPalette(std::span<const float> pixels, int count, uint64_t seed = 0);

}  // namespace retint
