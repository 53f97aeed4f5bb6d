// SPDX-License-Identifier: BSD-3-Clause
// The operations that a color edit is made of, on one pixel. Colors are display-referred sRGB
// triples, as splats store them; 0 to 1 is what a screen shows, and values outside pass through
// wherever an operation has a meaning there.
#pragma once

#include <cstdint>

#include "kernels/common/color_spaces.h"
#include "kernels/common/macros.h"

namespace retint {

inline constexpr int kMaxColorOps = 16;
inline constexpr int kMaxColorOpValues = 20;

// What `values` holds of each:
enum class ColorOpCode : int32_t {
  kMatrix,        // [3, 4] row-major: y' = M y + t on the encoded values
  kLinearMatrix,  // [3, 3] row-major, in linear light
  kPower,         // exponent: y' = y^exponent, odd for negative values
  kAdjust,        // see AdjustColor
  kRecolor,       // see RecolorColor
  kGradient,      // table of `size` colors by OKLab lightness from 0 to 1
  kTable,         // table of size^3 colors, red fastest, over [0, 1]^3
  kSoftClip,      // knee: see SoftClipColor
  kPalette,       // weight of lightness; table of `size` rows: see MovePalette
};

inline constexpr int kPaletteRow = 7;  // floats

struct ColorOp {
  ColorOpCode code;
  float strength;  // y + strength (op(y) - y)
  float values[kMaxColorOpValues];
  int32_t table;  // where its table begins in ColorProgram::tables, in floats
  int32_t size;   // of the table
};

// The operations of one edit, in the order in which they apply.
struct ColorProgram {
  int32_t count;
  float strength;  // of the whole: color + strength (list(color) - color)
  ColorOp ops[kMaxColorOps];
  const float* tables;  // in the memory of whoever runs the program
};

RETINT_HD float Clamp01(float x) { return x < 0 ? 0 : x > 1 ? 1 : x; }

// 0 at `low` and below, 1 at `high` and above; a step where both are the same.
RETINT_HD float SmoothStep(float low, float high, float x) {
  if (x <= low) return x < low || high > low ? 0.0f : 1.0f;
  if (x >= high) return 1.0f;
  const float t = (x - low) / (high - low);
  return t * t * (3 - 2 * t);
}

// 1 inside [low, high], falling to 0 over `edge` outside.
RETINT_HD float SoftRange(float low, float high, float edge, float x) {
  return SmoothStep(low - edge, low, x) * (1 - SmoothStep(high, high + edge, x));
}

// Hue turned, chroma and lightness multiplied, in OKLCh, for the colors of a range.
// values: cosine and sine of the hue's turn; factors of chroma and lightness; hues: begin in
// (-pi, pi], extent (2 pi: all hues), soft edge, radians; chroma: low, high; lightness: low, high;
// soft edge of both.
RETINT_HD void AdjustColor(const float* values, float* color) {
  const OkLab lab = OkLabFromSrgb(color);
  const float chroma = sqrtf(lab.a * lab.a + lab.b * lab.b);
  float share = SoftRange(values[7], values[8], values[11], chroma) *
                SoftRange(values[9], values[10], values[11], lab.lightness);
  constexpr float kTurn = 6.28318530718f;
  if (values[5] < kTurn) {
    // The hue of a gray means nothing: it belongs to no range.
    constexpr float kGray = 0.04f;
    const float extent = values[5], edge = values[6];
    float hue = atan2f(lab.b, lab.a) - values[4];
    hue -= kTurn * floorf(hue / kTurn);  // from the range's begin, [0, 2 pi)
    const float outside = hue <= extent ? 0 : fminf(hue - extent, kTurn - hue);
    share *= (1 - SmoothStep(0, edge, outside)) * SmoothStep(0, kGray, chroma);
  }
  if (share <= 0) return;
  const OkLab turned = {lab.lightness * values[3],
                        values[2] * (values[0] * lab.a - values[1] * lab.b),
                        values[2] * (values[1] * lab.a + values[0] * lab.b)};
  float full[3];
  SrgbFromOkLab(turned, full);
  for (int c = 0; c < 3; ++c) color[c] += share * (full[c] - color[c]);
}

// Gives a surface of one main color another: the dichromatic model of reflection (Shafer 1985) in
// the scene's light. A pixel is gloss, which is white, and body: shade times the main color, where
// texture and tinted light make the channels differ from it. Gloss stays, shade (the body's
// luminance over the main color's) multiplies the target, and the channels differ by a power of
// what they did.
// Gloss is told by the channels that the main color absorbs; a small share of it may as well be a
// paler texture, and counts less. What is brighter than any body of the region counts as gloss.
// values: main color over its luminance; target; (1 - p) / |1 - p|^2, p the projection of white
// onto the main color; how far gloss can be told, 0 to 1; luminances of main color and target;
// exponent of the differences; shade above which the excess is gloss; share of the lightness that
// is kept.
RETINT_HD void RecolorColor(const float* values, float* color) {
  constexpr float kSureGloss = 0.2f;  // share of a pixel's luminance from which it is gloss alone
  constexpr float kLeast = 1e-6f, kLeastRatio = 1e-3f;
  const float* base = values;
  const float* target = values + 3;
  const float* white = values + 6;
  const float from = values[10], to = values[11], limit = values[13];
  float body[3], gloss = 0;
  for (int c = 0; c < 3; ++c) {
    body[c] = SceneFromDisplay(LinearFromSrgb(color[c])) / from;
    gloss += body[c] * white[c];
  }
  gloss = fmaxf(fminf(gloss, fminf(body[0], fminf(body[1], body[2]))), 0.0f);
  gloss *= values[9] * SmoothStep(0, kSureGloss, gloss / fmaxf(Luminance(body), kLeast));
  for (int c = 0; c < 3; ++c) body[c] -= gloss;
  const float shade = fmaxf(Luminance(body), kLeast);
  float fitted = shade;
  if (shade > limit) {  // at most a quarter more
    fitted = limit * (1 + 0.25f * tanhf(4 * (shade / limit - 1)));
    gloss += shade - fitted;
  }
  float out[3];
  for (int c = 0; c < 3; ++c) {
    out[c] = target[c] * powf(fmaxf(body[c] / (shade * base[c]), kLeastRatio), values[12]);
  }
  const float scale = fitted * to / fmaxf(Luminance(out), kLeast);
  for (int c = 0; c < 3; ++c) {
    out[c] = SrgbFromLinear(DisplayFromScene(scale * out[c] + gloss * from));
  }
  const bool fits = out[0] <= 1 && out[1] <= 1 && out[2] <= 1;
  if (values[14] > 0 || !fits) {
    OkLab lab = OkLabFromSrgb(out);
    if (values[14] > 0) {
      lab.lightness += values[14] * (OkLabFromSrgb(color).lightness - lab.lightness);
    }
    CompressChroma(1, &lab);
    SrgbFromOkLab(lab, out);
  }
  for (int c = 0; c < 3; ++c) color[c] = out[c];
}

// Colors by lightness, `size` of them from black to white, linearly between.
RETINT_HD void GradientColor(const float* table, int size, float* color) {
  const float at = Clamp01(OkLabFromSrgb(color).lightness) * float(size - 1);
  const int low = int(at) < size - 2 ? int(at) : size - 2;
  const float t = at - float(low);
  for (int c = 0; c < 3; ++c) {
    color[c] = (1 - t) * table[3 * low + c] + t * table[3 * low + 3 + c];
  }
}

// Tetrahedral interpolation in a table of size^3 colors over [0, 1]^3, red fastest; colors outside
// are taken to the cube's surface first. The cube's diagonal, and with it gray, is interpolated
// along itself alone (Kasson et al. 1995).
RETINT_HD void TableColor(const float* table, int size, float* color) {
  int cell[3];
  float f[3];
  for (int c = 0; c < 3; ++c) {
    const float at = Clamp01(color[c]) * float(size - 1);
    cell[c] = int(at) < size - 2 ? int(at) : size - 2;
    f[c] = at - float(cell[c]);
  }
  // From the cell's low corner to its high one along the axes in the order of their fractions.
  const int first = f[0] >= f[1] ? (f[0] >= f[2] ? 0 : 2) : (f[1] >= f[2] ? 1 : 2);
  const int last = f[2] <= f[0] && f[2] <= f[1] && first != 2   ? 2
                   : f[1] <= f[0] && f[1] <= f[2] && first != 1 ? 1
                   : first != 0                                 ? 0
                                                                : 1;
  const int middle = 3 - first - last;
  const int64_t step[3] = {3, 3 * int64_t(size), 3 * int64_t(size) * size};
  const float* p0 = table + cell[0] * step[0] + cell[1] * step[1] + cell[2] * step[2];
  const float* p1 = p0 + step[first];
  const float* p2 = p1 + step[middle];
  const float* p3 = p2 + step[last];
  for (int c = 0; c < 3; ++c) {
    color[c] = (1 - f[first]) * p0[c] + (f[first] - f[middle]) * p1[c] +
               (f[middle] - f[last]) * p2[c] + f[last] * p3[c];
  }
}

// Where a color lies among main colors, at most about 1 long each way: its lightness, and a and b
// over it, which are the same for a surface in more or less light (OKLab is the cube root of
// light). Near black, where they would be noise, they shrink to 0.
RETINT_HD void PaletteCoordinates(const OkLab& lab, float lightness_weight, float* place) {
  constexpr float kColor = 0.7f;  // a lightness at which distances are those of OKLab
  constexpr float kDark = 0.25f;
  const float scale = kColor / fmaxf(lab.lightness, kDark);
  place[0] = lightness_weight * lab.lightness;
  place[1] = scale * lab.a;
  place[2] = scale * lab.b;
}

// Moves `size` main colors, and every other color by a mean of their moves: each counts by the
// inverse third power of its distance, see PaletteCoordinates (Shepard 1968; a higher power turns
// more suddenly between two colors). One move takes lightness L to L' = s L + o and a, b to
// s (a, b) + L' (u, v): in more or less light a color then keeps hue and saturation. What leaves
// the gamut loses chroma. table: [size, 7] of L, a, b, s, o, u, v.
RETINT_HD void MovePalette(const float* table, int size, float lightness_weight, float* color) {
  constexpr float kNear = 1e-6f;  // squared distance, so that a main color itself has a weight
  const OkLab lab = OkLabFromSrgb(color);
  float place[3], other[3];
  PaletteCoordinates(lab, lightness_weight, place);
  float total = 0, changed = 0, lightness = 0, chroma = 0, turned[2] = {0, 0};
  for (int i = 0; i < size; ++i) {
    const float* row = table + kPaletteRow * i;
    PaletteCoordinates({row[0], row[1], row[2]}, lightness_weight, other);
    const float d[3] = {place[0] - other[0], place[1] - other[1], place[2] - other[2]};
    const float near = 1 / (d[0] * d[0] + d[1] * d[1] + d[2] * d[2] + kNear);
    const float weight = near * sqrtf(near);
    const float moved = row[3] * lab.lightness + row[4];
    total += weight;
    if (row[3] != 1 || row[4] != 0 || row[5] != 0 || row[6] != 0) changed += weight;
    lightness += weight * moved;
    chroma += weight * row[3];
    turned[0] += weight * moved * row[5];
    turned[1] += weight * moved * row[6];
  }
  const float scale = 1 / total;
  OkLab mean = {scale * lightness, scale * (chroma * lab.a + turned[0]),
                scale * (chroma * lab.b + turned[1])};
  OkLab fitted = mean;
  CompressChroma(1, &fitted);
  mean.a += scale * changed * (fitted.a - mean.a);
  mean.b += scale * changed * (fitted.b - mean.b);
  SrgbFromOkLab(mean, color);
}

// Draws colors outside [0, 1] towards the gray of their luma until they fit. Smooth: colors whose
// distance from that gray is below `knee` of the way to the border stay, the others are compressed
// into the rest.
RETINT_HD void SoftClipColor(float knee, float* color) {
  const float luma = 0.2126f * color[0] + 0.7152f * color[1] + 0.0722f * color[2];
  const float gray = luma < 0.001f ? 0.001f : luma > 0.999f ? 0.999f : luma;
  float reach = 0;
  for (int c = 0; c < 3; ++c) {
    const float room = color[c] > gray ? 1 - gray : -gray;
    reach = fmaxf(reach, (color[c] - gray) / room);
  }
  if (reach <= knee) return;
  const float beyond = (reach - knee) / (1 - knee);
  const float fitted = knee + (1 - knee) * beyond / (1 + beyond);
  for (int c = 0; c < 3; ++c) color[c] = gray + (color[c] - gray) * (fitted / reach);
}

RETINT_HD void ApplyColorOp(const ColorOp& op, const float* tables, float* color) {
  const float in[3] = {color[0], color[1], color[2]};
  const float* v = op.values;
  switch (op.code) {
    case ColorOpCode::kMatrix:
      for (int c = 0; c < 3; ++c) {
        color[c] = v[4 * c] * in[0] + v[4 * c + 1] * in[1] + v[4 * c + 2] * in[2] + v[4 * c + 3];
      }
      break;
    case ColorOpCode::kLinearMatrix: {
      const float r = LinearFromSrgb(in[0]), g = LinearFromSrgb(in[1]), b = LinearFromSrgb(in[2]);
      for (int c = 0; c < 3; ++c) {
        color[c] = SrgbFromLinear(v[3 * c] * r + v[3 * c + 1] * g + v[3 * c + 2] * b);
      }
      break;
    }
    case ColorOpCode::kPower:
      for (int c = 0; c < 3; ++c) color[c] = copysignf(powf(fabsf(in[c]), v[0]), in[c]);
      break;
    case ColorOpCode::kAdjust:
      AdjustColor(v, color);
      break;
    case ColorOpCode::kRecolor:
      RecolorColor(v, color);
      break;
    case ColorOpCode::kGradient:
      GradientColor(tables + op.table, op.size, color);
      break;
    case ColorOpCode::kTable:
      TableColor(tables + op.table, op.size, color);
      break;
    case ColorOpCode::kSoftClip:
      SoftClipColor(v[0], color);
      break;
    case ColorOpCode::kPalette:
      MovePalette(tables + op.table, op.size, v[0], color);
      break;
  }
  if (op.strength == 1) return;
  for (int c = 0; c < 3; ++c) color[c] = in[c] + op.strength * (color[c] - in[c]);
}

// f(color), in place.
RETINT_HD void RunColorProgram(const ColorProgram& program, float* color) {
  const float in[3] = {color[0], color[1], color[2]};
  for (int i = 0; i < program.count; ++i) ApplyColorOp(program.ops[i], program.tables, color);
  if (program.strength == 1) return;
  for (int c = 0; c < 3; ++c) color[c] = in[c] + program.strength * (color[c] - in[c]);
}

}  // namespace retint
