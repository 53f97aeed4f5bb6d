// SPDX-License-Identifier: BSD-3-Clause
// The models for choosing a color: a hue, and an area of two other values at that hue.
#pragma once

#include <span>

#include <QColor>

namespace retint {

// A color as a place in a model: hue in the strip, x and y (up) in the area, all in [0, 1].
struct ColorPlace {
  double hue = 0, across = 0, up = 1;
};

struct ColorModel {
  const char* name;
  const char* across;  // the component that grows to the right
  const char* up;
  // The color of a place; invalid if sRGB has none there.
  QColor (*color)(const ColorPlace& place);
  // The place of a color. Grays take their hue from `before`, black also its saturation.
  ColorPlace (*place)(const QColor& color, const ColorPlace& before);
};

// HSV, and OKLCh (B. Ottosson 2020): chroma up to kMostChroma to the right, lightness upward.
std::span<const ColorModel> ColorModels();
inline constexpr double kMostChroma = 0.33;  // contains sRGB's colors; magenta has 0.322

// The color of a place. If sRGB has none, the nearest color of the same hue and height.
QColor NearestColor(const ColorModel& model, const ColorPlace& place);

}  // namespace retint
