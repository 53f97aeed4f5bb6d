// SPDX-License-Identifier: BSD-3-Clause
// The main colors of a region: what its pixels gather about.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace retint {

inline constexpr int kMaxPaletteColors = 16;
// Two colors that differ in lightness alone are this much closer than the same distance in hue or
// saturation: shading does not split a surface into several colors. Holds for finding a palette and
// for the weights of editing one.
inline constexpr float kPaletteLightnessWeight = 0.5f;

struct PaletteColor {
  std::array<float, 3> rgb = {};  // display-encoded, 0 to 1
  float share = 0;                // of the pixels that are nearest to it
  bool operator==(const PaletteColor&) const = default;
};

// Up to `count` (1 to kMaxPaletteColors) main colors of `pixels`, [N, 3], display-encoded: k-means
// in OKLab (Lloyd 1982) from several seeded starts (Arthur and Vassilvitskii 2007), of which the
// best is kept. A color is the median of its pixels, so that blends at edges do not move it. Most
// frequent first. Fewer where the pixels have fewer different colors; none where there is no pixel.
// The same pixels and seed give the same bits. OptionError for a count out of range.
std::vector<PaletteColor> FindPalette(std::span<const float> pixels, int count, uint64_t seed = 0);

}  // namespace retint
