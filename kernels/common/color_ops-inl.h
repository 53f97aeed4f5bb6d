// SPDX-License-Identifier: BSD-3-Clause
// The operations of color_ops.h on one pixel or on several side by side: as color_spaces-inl.h,
// which comes first, and with GradientAt(), TableColor(), CurveColor() and InverseCurveColor().

// 0 at `low` and below, 1 at `high` and above; a step where both are the same.
RETINT_HD Real SmoothStep(float low, float high, Real x) {
  const Real t = (x - low) / (high - low);
  const Truth is_below = high > low ? x <= low : x < low;
  return Select(is_below, 0, Select(x >= high, 1, t * t * (3 - 2 * t)));
}

// 1 inside [low, high], falling to 0 over `edge` outside.
RETINT_HD Real SoftRange(float low, float high, float edge, Real x) {
  return SmoothStep(low - edge, low, x) * (1 - SmoothStep(high, high + edge, x));
}

// Turns hue and multiplies chroma and lightness, in OKLCh, for the colors of a range.
// values: 0, 1 cosine and sine of the hue's turn. 2, 3 factors of chroma and lightness. 4-6 hues:
// begin in [0, 2 pi], extent (2 pi: all hues), soft edge, radians. 7, 8 chroma: low, high. 9, 10
// lightness: low, high. 11 soft edge of both.
RETINT_HD void AdjustColor(const float* values, Real* color) {
  const OkLab lab = OkLabFromSrgb(color);
  const Real chroma = sqrtf(lab.a * lab.a + lab.b * lab.b);
  Real share = SoftRange(values[7], values[8], values[11], chroma) *
               SoftRange(values[9], values[10], values[11], lab.lightness);
  constexpr float kTurn = 6.28318530718f;
  if (values[5] < kTurn) {
    // The hue of a gray means nothing: it belongs to no range.
    constexpr float kGray = 0.04f;
    const float extent = values[5], edge = values[6];
    Real hue = atan2f(lab.b, lab.a) - values[4];
    hue -= kTurn * floorf(hue / kTurn);  // from the range's begin, [0, 2 pi)
    const Real outside = Select(hue <= extent, 0, fminf(hue - extent, kTurn - hue));
    // Inside also where the edge is a step, at which SmoothStep() is 1 already.
    share *= Select(outside > 0, 1 - SmoothStep(0, edge, outside), 1);
    share *= SmoothStep(0, kGray, chroma);
  }
  if (!Any(share > 0)) return;
  const OkLab turned = {lab.lightness * values[3],
                        values[2] * (values[0] * lab.a - values[1] * lab.b),
                        values[2] * (values[1] * lab.a + values[0] * lab.b)};
  Real full[3];
  SrgbFromOkLab(turned, full);
  for (int c = 0; c < 3; ++c) color[c] += share * (full[c] - color[c]);
}

// Gives a surface of one main color another one, by the dichromatic model of reflection (Shafer
// 1985) in the scene's light. A pixel is gloss, which is white, plus body. The body is shade (its
// luminance over the main color's) times the main color, but texture and tinted light change its
// channels. Gloss stays, shade multiplies the target, and each channel's ratio to the main color is
// raised to a power. Gloss is measured in the channels that the main color absorbs. A small share
// of gloss may also be a paler texture, so it counts less. Light above the brightest body of the
// region counts as gloss. If the body is lighter than the target, its lightness is compressed into
// the range between target and white. If a channel then exceeds 1, the body is darkened to fit, and
// the missing light is added as white. Gloss fills the rest of a channel up to white, so no result
// exceeds 1.
// values: 0-2 main color over its luminance. 3-5 target. 6-8 (1 - p) / |1 - p|^2, p the projection
// of white onto the main color. 9 certainty with which gloss can be measured, 0 to 1. 10, 11
// luminances of main color and target. 12 exponent of the channels' ratios. 13 shade above which
// the excess is gloss. 14 share of the lightness that is kept. 15 the target's lightness (the cube
// root of its displayed luminance). 16 excess of lightness that puts a body half of the way to
// white.
RETINT_HD void RecolorColor(const float* values, Real* color) {
  constexpr float kSureGloss = 0.2f;  // share of a pixel's luminance from which it is gloss alone
  constexpr float kLeast = 1e-6f, kLeastRatio = 1e-3f;
  const float* base = values;
  const float* target = values + 3;
  const float* white = values + 6;
  const float from = values[10], to = values[11], limit = values[13];
  Real body[3], gloss = 0;
  for (int c = 0; c < 3; ++c) {
    body[c] = SceneFromDisplay(LinearFromSrgb(color[c])) / from;
    gloss += body[c] * white[c];
  }
  gloss = fmaxf(fminf(gloss, fminf(body[0], fminf(body[1], body[2]))), 0.0f);
  gloss *= values[9] * SmoothStep(0, kSureGloss, gloss / fmaxf(Luminance(body), kLeast));
  for (int c = 0; c < 3; ++c) body[c] -= gloss;
  const Real shade = fmaxf(Luminance(body), kLeast);
  // More light than the limit becomes gloss, more and more of it; twice the limit is the most.
  const Real fitted = Select(shade > limit, limit * (2 - limit / shade), shade);
  gloss += shade - fitted;
  Real out[3];
  for (int c = 0; c < 3; ++c) {
    out[c] = target[c] * powf(fmaxf(body[c] / (shade * base[c]), kLeastRatio), values[12]);
  }
  const Real scale = fitted * to / fmaxf(Luminance(out), kLeast);
  Real shown[3];
  for (int c = 0; c < 3; ++c) {
    out[c] *= scale;
    shown[c] = DisplayFromScene(out[c]);
  }
  const float lightness = values[15], half_way = values[16];
  const Real light = Luminance(shown), root = cbrtf(light);
  const Real beyond = fmaxf(root - lightness, 0.0f);
  const Truth fits = (beyond <= 0) & (shown[0] <= 1) & (shown[1] <= 1) & (shown[2] <= 1);
  if (Any(!fits)) {
    const Real compressed = fminf(root, lightness) + (1 - lightness) * beyond / (half_way + beyond);
    const Real wanted = compressed * compressed * compressed;
    const Real scaled = wanted / fmaxf(light, kLeast);
    const Real most = scaled * fmaxf(shown[0], fmaxf(shown[1], shown[2]));
    const Real fit = 1 / fmaxf(most, 1.0f);
    const Real left = wanted * fit;  // luminance
    const Real paler = (wanted - left) / fmaxf(1 - left, kLeast);
    for (int c = 0; c < 3; ++c) {
      const Real darker = fit * scaled * shown[c];
      out[c] = Select(fits, out[c], SceneFromDisplay(darker + paler * (1 - darker)));
    }
  }
  const Real added = fminf(gloss * from, kSceneWhite);
  for (int c = 0; c < 3; ++c) {
    out[c] += added * (1 - out[c] / kSceneWhite);
    out[c] = SrgbFromLinear(DisplayFromScene(out[c]));
  }
  if (values[14] > 0) {
    OkLab lab = OkLabFromSrgb(out);
    lab.lightness += values[14] * (OkLabFromSrgb(color).lightness - lab.lightness);
    CompressChroma(1, &lab);
    SrgbFromOkLab(lab, out);
  }
  for (int c = 0; c < 3; ++c) color[c] = out[c];
}

// Colors by lightness, `size` of them from black to white.
RETINT_HD void GradientColor(const float* table, int size, Real* color) {
  GradientAt(table, size, Clamp01(OkLabFromSrgb(color).lightness), color);
}

// Coordinates of a color among main colors, each at most about 1: its lightness, and a and b over
// it. The latter are equal for a surface in more or less light (OKLab is the cube root of light).
// They shrink to 0 near black, because they would be noise there.
RETINT_HD void PaletteCoordinates(const OkLab& lab, float lightness_weight, Real* place) {
  constexpr float kColor = 0.7f;  // a lightness at which distances are those of OKLab
  constexpr float kDark = 0.25f;
  const Real scale = kColor / fmaxf(lab.lightness, kDark);
  place[0] = lightness_weight * lab.lightness;
  place[1] = scale * lab.a;
  place[2] = scale * lab.b;
}

// Moves `size` main colors, and every other color by a weighted mean of their moves. A weight is
// the inverse third power of the distance in PaletteCoordinates (Shepard 1968); a higher power
// changes more suddenly between two colors. One move takes lightness L to L' = s L + o, and a, b to
// s (a, b) + L' (u, v). So a color keeps hue and saturation in more or less light. Results outside
// the gamut lose chroma. table: [size, 7] of L, a, b, s, o, u, v.
RETINT_HD void MovePalette(const float* table, int size, float lightness_weight, Real* color) {
  constexpr float kNear = 1e-6f;  // squared distance, so that a main color itself has a weight
  const OkLab lab = OkLabFromSrgb(color);
  Real place[3], other[3];
  PaletteCoordinates(lab, lightness_weight, place);
  Real total = 0, changed = 0, lightness = 0, chroma = 0, turned[2] = {0, 0};
  for (int i = 0; i < size; ++i) {
    const float* row = table + kPaletteRow * i;
    PaletteCoordinates({row[0], row[1], row[2]}, lightness_weight, other);
    const Real d[3] = {place[0] - other[0], place[1] - other[1], place[2] - other[2]};
    const Real near = 1 / (d[0] * d[0] + d[1] * d[1] + d[2] * d[2] + kNear);
    const Real weight = near * sqrtf(near);
    const Real moved = row[3] * lab.lightness + row[4];
    total += weight;
    if (row[3] != 1 || row[4] != 0 || row[5] != 0 || row[6] != 0) changed += weight;
    lightness += weight * moved;
    chroma += weight * row[3];
    turned[0] += weight * moved * row[5];
    turned[1] += weight * moved * row[6];
  }
  const Real scale = 1 / total;
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
RETINT_HD void SoftClipColor(float knee, Real* color) {
  const Real luma = 0.2126f * color[0] + 0.7152f * color[1] + 0.0722f * color[2];
  const Real gray = fminf(fmaxf(luma, 0.001f), 0.999f);
  Real reach = 0;
  for (int c = 0; c < 3; ++c) {
    const Real room = Select(color[c] > gray, 1 - gray, -gray);
    reach = fmaxf(reach, (color[c] - gray) / room);
  }
  if (!Any(reach > knee)) return;
  const Real beyond = (reach - knee) / (1 - knee);
  const Real fitted = knee + (1 - knee) * beyond / (1 + beyond);
  for (int c = 0; c < 3; ++c) {
    const Real drawn = gray + (color[c] - gray) * (fitted / reach);
    color[c] = Select(reach > knee, drawn, color[c]);
  }
}

// matrix: [3, 3] row-major
RETINT_HD void MultiplyColor(const float* matrix, Real* color) {
  const Real r = color[0], g = color[1], b = color[2];
  for (int c = 0; c < 3; ++c) {
    color[c] = matrix[3 * c] * r + matrix[3 * c + 1] * g + matrix[3 * c + 2] * b;
  }
}

RETINT_HD void ApplyColorOp(const ColorOp& op, const float* tables, Real* color) {
  const Real in[3] = {color[0], color[1], color[2]};
  const float* v = op.values;
  switch (op.code) {
    case ColorOpCode::kMatrix:
      for (int c = 0; c < 3; ++c) {
        color[c] = v[4 * c] * in[0] + v[4 * c + 1] * in[1] + v[4 * c + 2] * in[2] + v[4 * c + 3];
      }
      break;
    case ColorOpCode::kLinearMatrix:
      for (int c = 0; c < 3; ++c) color[c] = LinearFromSrgb(in[c]);
      MultiplyColor(v, color);
      for (int c = 0; c < 3; ++c) color[c] = SrgbFromLinear(color[c]);
      break;
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
    case ColorOpCode::kEncode:
      if (op.size > 0) CurveColor(tables + op.table, op.size, color);
      MultiplyColor(v, color);
      for (int c = 0; c < 3; ++c) color[c] = SrgbFromLinear(color[c]);
      break;
    case ColorOpCode::kDecode:
      for (int c = 0; c < 3; ++c) color[c] = LinearFromSrgb(in[c]);
      MultiplyColor(v, color);
      if (op.size > 0) InverseCurveColor(tables + op.table, op.size, color);
      break;
  }
  if (op.strength == 1) return;
  for (int c = 0; c < 3; ++c) color[c] = in[c] + op.strength * (color[c] - in[c]);
}

// f(color), in place.
RETINT_HD void RunColorProgram(const ColorProgram& program, Real* color) {
  const Real in[3] = {color[0], color[1], color[2]};
  for (int i = 0; i < program.count; ++i) ApplyColorOp(program.ops[i], program.tables, color);
  if (program.strength == 1) return;
  for (int c = 0; c < 3; ++c) color[c] = in[c] + program.strength * (color[c] - in[c]);
}

// `edited` may be `color`, both [3]; `share` is the mask's. A share of 0 keeps every bit of the
// color.
RETINT_HD void ApplyColorMap(const ColorMap& map, Real share, const Real* color, Real* edited) {
  const Real r = color[0], g = color[1], b = color[2];
  if (map.program && map.program->encodes) {
    const ColorProgram& program = *map.program;
    Real full[3] = {r, g, b};
    ApplyColorOp(program.encode, program.tables, full);
    Real mixed[3] = {full[0], full[1], full[2]};
    if (Any(share > 0)) RunColorProgram(program, full);
    for (int c = 0; c < 3; ++c) mixed[c] += share * (full[c] - mixed[c]);
    ApplyColorOp(program.decode, program.tables, mixed);
    for (int c = 0; c < 3; ++c) edited[c] = Select(share > 0, mixed[c], color[c]);
    return;
  }
  if (map.program) {
    Real full[3] = {r, g, b};
    if (Any(share > 0)) RunColorProgram(*map.program, full);
    for (int c = 0; c < 3; ++c) {
      edited[c] = Select(share > 0, color[c] + share * (full[c] - color[c]), color[c]);
    }
    return;
  }
  for (int c = 0; c < 3; ++c) {
    const float* row = map.delta + 3 * c;
    edited[c] = color[c] + share * (row[0] * r + row[1] * g + row[2] * b + map.offset[c]);
  }
}
