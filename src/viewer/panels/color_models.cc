// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/panels/color_models.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "kernels/common/color_spaces.h"

namespace retint {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;
constexpr double kLastHue = 0.9999;  // of Qt's HSV: 1 would equal 0
constexpr double kGray = 2e-3;       // below this chroma, hue is noise: half a step of 1 / 255

QColor FromHsv(const ColorPlace& place) {
  return QColor::fromHsvF(float(std::min(place.hue, kLastHue)), float(place.across),
                          float(place.up))
      .toRgb();
}

ColorPlace HsvOf(const QColor& color, const ColorPlace& before) {
  const double hue = color.hsvHueF();
  return {hue < 0 ? before.hue : hue, color.value() == 0 ? before.across : color.hsvSaturationF(),
          color.valueF()};
}

QColor FromOkLch(const ColorPlace& place) {
  // For each channel: rounding must not exclude white and the primaries.
  constexpr float kEdge = 0.5F / 255;
  const double chroma = place.across * kMostChroma, angle = place.hue * kTurn;
  const OkLab lab{float(place.up), float(chroma * std::cos(angle)),
                  float(chroma * std::sin(angle))};
  float rgb[3];
  SrgbFromOkLab(lab, rgb);
  for (float& value : rgb) {
    if (!(value >= -kEdge && value <= 1 + kEdge)) return {};
    value = std::clamp(value, 0.0F, 1.0F);
  }
  return QColor::fromRgbF(rgb[0], rgb[1], rgb[2]);
}

ColorPlace OkLchOf(const QColor& color, const ColorPlace& before) {
  const float rgb[3] = {color.redF(), color.greenF(), color.blueF()};
  const OkLab lab = OkLabFromSrgb(rgb);
  const double chroma = std::hypot(lab.a, lab.b);
  double hue = before.hue;
  if (chroma > kGray) {
    hue = std::atan2(lab.b, lab.a) / kTurn;
    if (hue < 0) hue += 1;
  }
  return {hue, std::min(1.0, chroma / kMostChroma), std::clamp(double(lab.lightness), 0.0, 1.0)};
}

constexpr ColorModel kModels[] = {{"HSV", "Saturation", "value", FromHsv, HsvOf},
                                  {"OKLCh", "Chroma", "lightness", FromOkLch, OkLchOf}};

}  // namespace

std::span<const ColorModel> ColorModels() { return kModels; }

QColor NearestColor(const ColorModel& model, const ColorPlace& place) {
  const QColor color = model.color(place);
  if (color.isValid()) return color;
  // Gray is always a valid color.
  ColorPlace inside = place, outside = place;
  inside.across = 0;
  constexpr int kHalvings = 12;
  for (int i = 0; i < kHalvings; ++i) {
    ColorPlace middle = inside;
    middle.across = (inside.across + outside.across) / 2;
    (model.color(middle).isValid() ? inside : outside) = middle;
  }
  return model.color(inside);
}

}  // namespace retint
