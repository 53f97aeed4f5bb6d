// SPDX-License-Identifier: BSD-3-Clause
// sRGB (IEC 61966-2-1), OKLab (B. Ottosson 2020) and a camera's tone curve, extended to values
// below 0 as odd functions.
#pragma once

#include <cmath>

#include "kernels/common/macros.h"

namespace retint {

RETINT_HD float LinearFromSrgb(float x) {
  const float y = fabsf(x);
  const float linear = y <= 0.04045f ? y / 12.92f : powf((y + 0.055f) / 1.055f, 2.4f);
  return copysignf(linear, x);
}

RETINT_HD float SrgbFromLinear(float x) {
  const float y = fabsf(x);
  const float encoded = y <= 0.0031308f ? 12.92f * y : 1.055f * powf(y, 1 / 2.4f) - 0.055f;
  return copysignf(encoded, x);
}

// Cameras compress bright light before they encode it. As most do not tell their curve, a usual one
// stands for all: y = x (1 + x / w^2) / (1 + x) (E. Reinhard et al. 2002, equation 4), with the
// light w that becomes the display's white five stops above a middle gray of 0.18.
inline constexpr float kSceneWhite = 6;

// The scene's light from the display's (linear, 1 is white), per channel, and back.
RETINT_HD float SceneFromDisplay(float display) {
  const float y = fabsf(display), room = 1 - y;
  const float root = sqrtf(room * room + 4 * y / (kSceneWhite * kSceneWhite));
  const float x = y <= 1 ? 2 * y / (room + root)  // the same number; either loses no digits
                         : 0.5f * kSceneWhite * kSceneWhite * (root - room);
  return copysignf(x, display);
}

RETINT_HD float DisplayFromScene(float scene) {
  const float x = fabsf(scene);
  return copysignf(x * (1 + x / (kSceneWhite * kSceneWhite)) / (1 + x), scene);
}

// Rec. 709, of linear light.
RETINT_HD float Luminance(const float* rgb) {
  return 0.2126f * rgb[0] + 0.7152f * rgb[1] + 0.0722f * rgb[2];
}

struct OkLab {
  float lightness, a, b;  // white has lightness 1; grays have a = b = 0
};

RETINT_HD OkLab OkLabFromLinear(const float* rgb) {
  const float r = rgb[0], g = rgb[1], b = rgb[2];
  const float l = cbrtf(0.4122214708f * r + 0.5363325363f * g + 0.0514459929f * b);
  const float m = cbrtf(0.2119034982f * r + 0.6806995451f * g + 0.1073969566f * b);
  const float s = cbrtf(0.0883024619f * r + 0.2817188376f * g + 0.6299787005f * b);
  return {0.2104542553f * l + 0.7936177850f * m - 0.0040720468f * s,
          1.9779984951f * l - 2.4285922050f * m + 0.4505937099f * s,
          0.0259040371f * l + 0.7827717662f * m - 0.8086757660f * s};
}

RETINT_HD void LinearFromOkLab(const OkLab& lab, float* rgb) {
  const float lc = lab.lightness + 0.3963377774f * lab.a + 0.2158037573f * lab.b;
  const float mc = lab.lightness - 0.1055613458f * lab.a - 0.0638541728f * lab.b;
  const float sc = lab.lightness - 0.0894841775f * lab.a - 1.2914855480f * lab.b;
  const float l = lc * lc * lc, m = mc * mc * mc, s = sc * sc * sc;
  rgb[0] = 4.0767416621f * l - 3.3077115913f * m + 0.2309699292f * s;
  rgb[1] = -1.2684380046f * l + 2.6097574011f * m - 0.3413193965f * s;
  rgb[2] = -0.0041960863f * l - 0.7034186147f * m + 1.7076147010f * s;
}

// `rgb` [3], display-encoded.
RETINT_HD OkLab OkLabFromSrgb(const float* rgb) {
  const float linear[3] = {LinearFromSrgb(rgb[0]), LinearFromSrgb(rgb[1]), LinearFromSrgb(rgb[2])};
  return OkLabFromLinear(linear);
}

RETINT_HD void SrgbFromOkLab(const OkLab& lab, float* rgb) {
  LinearFromOkLab(lab, rgb);
  for (int c = 0; c < 3; ++c) rgb[c] = SrgbFromLinear(rgb[c]);
}

// Room for rounding at the gamut's border, in linear light.
constexpr float kGamutRounding = 1e-4f;

// Whether a screen shows the color; `rgb` [3] is its linear light.
RETINT_HD bool IsInGamut(const OkLab& lab, float* rgb) {
  LinearFromOkLab(lab, rgb);
  for (int c = 0; c < 3; ++c) {
    if (!(rgb[c] >= -kGamutRounding && rgb[c] <= 1 + kGamutRounding)) return false;
  }
  return true;
}

// How far along the way from its gray to the color the gamut reaches, at most `most`: at 1 the
// color lies on its border. Bisection, then where a line through the last two points takes the
// first channel out: the result does not jump where rounding, which differs between devices, turns
// one of the steps around.
RETINT_HD float GamutReach(const OkLab& lab, float most) {
  float inside[3], outside[3], middle[3];
  if (IsInGamut({lab.lightness, most * lab.a, most * lab.b}, outside)) return most;
  if (!IsInGamut({lab.lightness, 0, 0}, inside)) return 0;
  float low = 0, high = most;
  for (int i = 0; i < 9; ++i) {
    const float at = 0.5f * (low + high);
    const bool is_inside = IsInGamut({lab.lightness, at * lab.a, at * lab.b}, middle);
    (is_inside ? low : high) = at;
    for (int c = 0; c < 3; ++c) (is_inside ? inside : outside)[c] = middle[c];
  }
  float share = 1;
  for (int c = 0; c < 3; ++c) {
    const float border = outside[c] > 1 ? 1 + kGamutRounding : -kGamutRounding;
    const bool leaves = outside[c] > 1 + kGamutRounding || outside[c] < -kGamutRounding;
    if (leaves) share = fminf(share, (border - inside[c]) / (outside[c] - inside[c]));
  }
  return low + share * (high - low);
}

// Less chroma at the same hue and lightness, until a screen shows the color. Chroma below `knee` of
// the largest that there is stays; above, it is compressed into the rest. `knee` in (0, 1].
RETINT_HD void CompressChroma(float knee, OkLab* lab) {
  const float reach = GamutReach(*lab, 1 / knee);
  const float used = reach > 0 ? 1 / reach : 1e6f;  // of the largest chroma
  if (used <= knee * 1.0001f) return;
  const float room = 1 - knee, beyond = used - knee;
  const float fitted = room > 1e-4f ? knee + room * beyond / (room + beyond) : 1.0f;
  const float scale = fitted / used;
  lab->a *= scale;
  lab->b *= scale;
}

}  // namespace retint
