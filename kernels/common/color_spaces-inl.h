// SPDX-License-Identifier: BSD-3-Clause
// The formulas of color_spaces.h for one color or several side by side. The including namespace
// defines `Real` (one or several numbers) and `Truth` (the result of comparing them), with
// Select(), Any(), the functions of <cmath>, and arithmetic with floats.

RETINT_HD Real LinearFromSrgb(Real x) {
  const Real y = fabsf(x);
  return copysignf(Select(y <= 0.04045f, y / 12.92f, powf((y + 0.055f) / 1.055f, 2.4f)), x);
}

RETINT_HD Real SrgbFromLinear(Real x) {
  const Real y = fabsf(x);
  return copysignf(Select(y <= 0.0031308f, 12.92f * y, 1.055f * powf(y, 1 / 2.4f) - 0.055f), x);
}

// Cameras compress bright light before they encode it. As most do not tell their curve, a usual one
// stands for all: y = x (1 + x / w^2) / (1 + x) (E. Reinhard et al. 2002, equation 4), with the
// light w that becomes the display's white five stops above a middle gray of 0.18.
inline constexpr float kSceneWhite = 6;

// The scene's light from the display's (linear, 1 is white), per channel, and back.
RETINT_HD Real SceneFromDisplay(Real display) {
  const Real y = fabsf(display), room = 1 - y;
  const Real root = sqrtf(room * room + 4 * y / (kSceneWhite * kSceneWhite));
  const Real x = Select(y <= 1, 2 * y / (room + root),  // the same number; either loses no digits
                        0.5f * kSceneWhite * kSceneWhite * (root - room));
  return copysignf(x, display);
}

RETINT_HD Real DisplayFromScene(Real scene) {
  const Real x = fabsf(scene);
  return copysignf(x * (1 + x / (kSceneWhite * kSceneWhite)) / (1 + x), scene);
}

// Rec. 709, of linear light.
RETINT_HD Real Luminance(const Real* rgb) {
  return 0.2126f * rgb[0] + 0.7152f * rgb[1] + 0.0722f * rgb[2];
}

struct OkLab {
  Real lightness, a, b;  // white has lightness 1; grays have a = b = 0
};

RETINT_HD OkLab OkLabFromLinear(const Real* rgb) {
  const Real r = rgb[0], g = rgb[1], b = rgb[2];
  const Real l = cbrtf(0.4122214708f * r + 0.5363325363f * g + 0.0514459929f * b);
  const Real m = cbrtf(0.2119034982f * r + 0.6806995451f * g + 0.1073969566f * b);
  const Real s = cbrtf(0.0883024619f * r + 0.2817188376f * g + 0.6299787005f * b);
  return {0.2104542553f * l + 0.7936177850f * m - 0.0040720468f * s,
          1.9779984951f * l - 2.4285922050f * m + 0.4505937099f * s,
          0.0259040371f * l + 0.7827717662f * m - 0.8086757660f * s};
}

RETINT_HD void LinearFromOkLab(const OkLab& lab, Real* rgb) {
  const Real lc = lab.lightness + 0.3963377774f * lab.a + 0.2158037573f * lab.b;
  const Real mc = lab.lightness - 0.1055613458f * lab.a - 0.0638541728f * lab.b;
  const Real sc = lab.lightness - 0.0894841775f * lab.a - 1.2914855480f * lab.b;
  const Real l = lc * lc * lc, m = mc * mc * mc, s = sc * sc * sc;
  rgb[0] = 4.0767416621f * l - 3.3077115913f * m + 0.2309699292f * s;
  rgb[1] = -1.2684380046f * l + 2.6097574011f * m - 0.3413193965f * s;
  rgb[2] = -0.0041960863f * l - 0.7034186147f * m + 1.7076147010f * s;
}

// `rgb` [3], display-encoded.
RETINT_HD OkLab OkLabFromSrgb(const Real* rgb) {
  const Real linear[3] = {LinearFromSrgb(rgb[0]), LinearFromSrgb(rgb[1]), LinearFromSrgb(rgb[2])};
  return OkLabFromLinear(linear);
}

RETINT_HD void SrgbFromOkLab(const OkLab& lab, Real* rgb) {
  LinearFromOkLab(lab, rgb);
  for (int c = 0; c < 3; ++c) rgb[c] = SrgbFromLinear(rgb[c]);
}

// Room for rounding at the gamut's border, in linear light.
constexpr float kGamutRounding = 1e-4f;

// Whether a screen shows a channel's linear light.
RETINT_HD Truth IsShown(Real x) { return (x >= -kGamutRounding) & (x <= 1 + kGamutRounding); }

// Whether a screen shows the color; `rgb` [3] is its linear light.
RETINT_HD Truth IsInGamut(const OkLab& lab, Real* rgb) {
  LinearFromOkLab(lab, rgb);
  const Truth red = IsShown(rgb[0]), green = IsShown(rgb[1]), blue = IsShown(rgb[2]);
  return red & green & blue;
}

// How far along the way from its gray to the color the gamut reaches, at most `most`: at 1 the
// color lies on its border. Bisection; then a line through the last two points gives the place at
// which the first channel leaves the gamut. So the result does not jump if rounding, which differs
// between devices, changes the decision of one step.
RETINT_HD Real GamutReach(const OkLab& lab, float most) {
  Real inside[3], outside[3], middle[3];
  const Truth fits = IsInGamut({lab.lightness, most * lab.a, most * lab.b}, outside);
  if (!Any(!fits)) return most;
  const Truth gray_fits = IsInGamut({lab.lightness, 0, 0}, inside);
  if (!Any(gray_fits & !fits)) return Select(fits, most, 0);
  Real low = 0, high = most;
  for (int i = 0; i < 9; ++i) {
    const Real at = 0.5f * (low + high);
    const Truth is_inside = IsInGamut({lab.lightness, at * lab.a, at * lab.b}, middle);
    low = Select(is_inside, at, low);
    high = Select(is_inside, high, at);
    for (int c = 0; c < 3; ++c) {
      inside[c] = Select(is_inside, middle[c], inside[c]);
      outside[c] = Select(is_inside, outside[c], middle[c]);
    }
  }
  Real share = 1;
  for (int c = 0; c < 3; ++c) {
    const Real border = Select(outside[c] > 1, 1 + kGamutRounding, -kGamutRounding);
    const Real leaves_at = (border - inside[c]) / (outside[c] - inside[c]);
    share = Select(IsShown(outside[c]), share, fminf(share, leaves_at));
  }
  return Select(fits, most, Select(gray_fits, low + share * (high - low), 0));
}

// Less chroma at the same hue and lightness, until a screen shows the color. Chroma below `knee` of
// the largest that there is stays; above, it is compressed into the rest. `knee` in [0, 1]; below a
// twentieth it counts as that, as the gamut is looked for as far as 1 / knee.
RETINT_HD void CompressChroma(float knee, OkLab* lab) {
  constexpr float kLeast = 0.05f;
  knee = knee > kLeast ? knee : kLeast;
  const Real reach = GamutReach(*lab, 1 / knee);
  const Real used = Select(reach > 0, 1 / reach, 1e6f);  // of the largest chroma
  const float room = 1 - knee;
  const Real beyond = used - knee;
  const Real fitted = room > 1e-4f ? knee + room * beyond / (room + beyond) : Real(1);
  const Real scale = Select(used <= knee * 1.0001f, 1, fitted / used);
  lab->a *= scale;
  lab->b *= scale;
}

// NaN becomes 0, so that the result can index a table.
RETINT_HD Real Clamp01(Real x) { return Select(x > 0, Select(x < 1, x, 1), 0); }
