// SPDX-License-Identifier: BSD-3-Clause
// The one color that a person would call a region's color.
#pragma once

#include <array>
#include <optional>
#include <span>

namespace retint {

struct MainColor {
  std::array<float, 3> rgb = {};  // display-encoded
  // How much brighter, in linear light, the surface gets in full light than its main color:
  // brighter pixels are gloss. At least 1.
  float brightest = 1;
};

// Of `pixels`, [N, 3], display-encoded. Hue and saturation are the most frequent ones (OKLab's a
// and b over its lightness, which shading leaves alone). Lightness is that of a lit pixel: three
// tenths of the pixels that have them are brighter. So neither gloss and shadows nor a minority of
// another color moves it. `elsewhere`, [M, 3]: pixels of other views, in which the same surface may
// get more light. Empty when there is no pixel.
std::optional<MainColor> FindMainColor(std::span<const float> pixels,
                                       std::span<const float> elsewhere = {});

}  // namespace retint
