// SPDX-License-Identifier: BSD-3-Clause
// The models in which a color is chosen: a hue, and two values that span an area at that hue.
#pragma once

#include <span>

#include <QColor>

namespace retint {

// A color as its place in a model: the hue of the strip, right and up in the area, all from 0 to 1.
struct ColorPlace {
  double hue = 0, across = 0, up = 1;
};

struct ColorModel {
  const char* name;
  const char* across;  // the component that grows to the right
  const char* up;
  // The color of a place; invalid where sRGB has none.
  QColor (*color)(const ColorPlace& place);
  // The place of a color. A gray has no hue, and black no saturation: there `before` holds.
  ColorPlace (*place)(const QColor& color, const ColorPlace& before);
};

// HSV, and OKLCh (B. Ottosson 2020): chroma to the right, up to kMostChroma, lightness upwards.
std::span<const ColorModel> ColorModels();
inline constexpr double kMostChroma = 0.33;  // of sRGB's colors; magenta has 0.322

// The color of a place; where sRGB has none, that of the same hue and height that lies nearest.
QColor NearestColor(const ColorModel& model, const ColorPlace& place);

}  // namespace retint
