// SPDX-License-Identifier: BSD-3-Clause
#include "recolor/operation_table.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <string>

#include "base/error.h"
#include "base/option_name.h"
#include "kernels/common/color_spaces.h"
#include "recolor/palette.h"

namespace retint {
namespace {

using Kind = ColorOperationKind;
using Form = ColorParameter::Form;

constexpr OptionTier kEveryday = OptionTier::kEveryday;
constexpr float kHuge = 1e6f;
constexpr int kMostPairValues = kMaxPaletteColors * int(kPairValues);

// name, count, default, least, most, required, form
constexpr ColorParameter kTint[] = {{"color", 3, 1, 0, kHuge, true, Form::kColor}};
constexpr ColorParameter kMatrix[] = {{"rows", 12, 0, -kHuge, kHuge, true}};
constexpr ColorParameter kExposure[] = {{"stops", 1, 0, -10, 10, true}};
constexpr ColorParameter kContrast[] = {{"factor", 1, 1, 0, 10, true}, {"pivot", 1, 0.5f, 0, 1}};
constexpr ColorParameter kGamma[] = {{"gamma", 1, 1, 0.1f, 10, true}};
constexpr ColorParameter kWhiteBalance[] = {{"temperature", 1, 0, -100, 100},
                                            {"tint", 1, 0, -100, 100}};
constexpr ColorParameter kSaturation[] = {{"factor", 1, 1, 0, 10, true}};
constexpr ColorParameter kAdjust[] = {{"hue", 1, 0, -360, 360},     {"chroma", 1, 1, 0, 10},
                                      {"lightness", 1, 1, 0, 10},   {"hues", 2, 0, 0, 360},
                                      {"hue_edge", 1, 15, 0, 180},  {"chromas", 2, 0, 0, 10},
                                      {"lightnesses", 2, 0, 0, 10}, {"edge", 1, 0.05f, 0, 1}};
constexpr ColorParameter kRecolor[] = {{"to", 3, 0, 0, 1, true, Form::kColor},
                                       {"keep_lightness", 1, 0, 0, 1},
                                       {"from", 3, kUnset, 0, 1, false, Form::kColor},
                                       {"brightest", 1, kUnset, 1, 100}};
constexpr ColorParameter kGradient[] = {{"stops", 64, 0, 0, 1, true, Form::kStops}};
constexpr ColorParameter kPalette[] = {
    {"colors", kMostPairValues, kUnset, 0, 1, true, Form::kPairs}};
// The errors of a color map: the median DeltaE00 of the pixels that it explains, and their
// fraction.
constexpr ColorParameter kPicture[] = {{"residual", 1, kUnset, 0, 1000},
                                       {"explained", 1, kUnset, 0, 1}};
constexpr ColorParameter kSoftClip[] = {{"knee", 1, 0.8f, 0, 0.99f}};

constexpr ColorOperationType kTypes[] = {
    {Kind::kTint, "tint", "tint", "R,G,B|COLOR",
     "Multiply the colors: three factors >= 0, or a color (0-255 become 0-1)", kTint},
    {Kind::kMatrix, "matrix", "matrix", "M11,M12,...,M34",
     "Affine map of the encoded colors: a 3x4 matrix, row by row", kMatrix},
    {Kind::kExposure, "exposure", "exposure", "STOPS",
     "Brighten (or darken, below 0) in linear light; one stop doubles the "
     "light",
     kExposure, kEveryday},
    {Kind::kContrast, "contrast", "contrast", "FACTOR[,PIVOT]",
     "Spread the colors about the pivot, 0.5 by default", kContrast, kEveryday},
    {Kind::kGamma, "gamma", "gamma", "GAMMA",
     "Raise the encoded colors to 1/GAMMA; above 1 brightens the middle tones", kGamma},
    {Kind::kWhiteBalance, "white_balance", "white-balance", "TEMPERATURE[,TINT]|gray=COLOR",
     "Warmer (above 0) or cooler light, in mired; TINT above 0 is towards magenta; or make this "
     "color gray",
     kWhiteBalance, kEveryday},
    {Kind::kSaturation, "saturation", "saturation", "FACTOR",
     "Spread the colors about their luma: 0 is gray, 1 changes nothing", kSaturation, kEveryday},
    {Kind::kInvert, "invert", "invert", "", "Turn every color into its complement", {}},
    {Kind::kGray, "gray", "gray", "", "Replace colors by the gray of the same luminance", {}},
    {Kind::kAdjust, "adjust", "adjust", "KEY=VALUE,...",
     "In OKLCh: hue (degrees added), chroma and lightness (factors), such as hue=-120,chroma=1.2. "
     "hues=A:B, chromas=A:B and lightnesses=A:B limit it to these colors, with soft edges of "
     "hue-edge (degrees) and edge",
     kAdjust, kEveryday},
    {Kind::kRecolor, "recolor", "to", "#rrggbb|NAME",
     "Make the region this color, such as '#3060ff' or teal; shading, texture and highlights stay",
     kRecolor, kEveryday},
    {Kind::kGradient, "gradient", "gradient", "[AT:]COLOR,...",
     "Replace colors by their lightness: colors from dark to light, evenly or "
     "AT 0 to 1",
     kGradient},
    {Kind::kPalette, "palette", "palette", "K,INDEX=COLOR,...",
     "Replace main colors of the region; K says how many to measure, INDEX which of them, as "
     "`retint palette` "
     "counts, becomes COLOR. Or list the colors: COLOR stays, COLOR=COLOR changes",
     kPalette, kEveryday},
    {Kind::kLut,
     "lut",
     "lut",
     "FILE[,strength=S]",
     "Look colors up in a .cube, .3dl, .clf, .cdl, .cc or .ccc",
     {},
     kEveryday},
    {Kind::kPicture, "picture", "edited", "NAME=FILE[,strength=S]",
     "Take over the changes of a paint program in a render or photo of view NAME; repeatable for "
     "several views",
     kPicture, kEveryday},
    {Kind::kSoftClip, "soft_clip", "soft-clip", "",
     "Draw colors that no screen shows softly back into the range, keeping "
     "their luma",
     kSoftClip},
};

const Eigen::Matrix3f kIdentity = Eigen::Matrix3f::Identity();
const Eigen::RowVector3f kLuma(0.2126f, 0.7152f, 0.0722f);  // Rec. 709

Eigen::Vector3f LinearOf(std::span<const float> color) {
  return {LinearFromSrgb(color[0]), LinearFromSrgb(color[1]), LinearFromSrgb(color[2])};
}

// CIE 1960 u, v of a black body of `mired`, 1e6 / kelvin (M. Krystek 1985).
Eigen::Vector2d BlackBody(double mired) {
  const double t = 1e6 / mired;
  return {(0.860117757 + 1.54118254e-4 * t + 1.28641212e-7 * t * t) /
              (1 + 8.42420235e-4 * t + 7.08145163e-7 * t * t),
          (0.317398726 + 4.22806245e-5 * t + 4.20481691e-8 * t * t) /
              (1 - 2.89741816e-5 * t + 1.61456053e-7 * t * t)};
}

// Linear sRGB of the chromaticity u, v.
Eigen::Vector3d LinearOfChromaticity(const Eigen::Vector2d& uv) {
  const double d = 2 * uv[0] - 8 * uv[1] + 4, x = 3 * uv[0] / d, y = 2 * uv[1] / d;
  const Eigen::Vector3d xyz(x / y, 1, (1 - x - y) / y);
  Eigen::Matrix3d rgb_from_xyz;  // IEC 61966-2-1
  rgb_from_xyz << 3.2404542, -1.5371385, -0.4985314, -0.9692660, 1.8760108, 0.0415560, 0.0556434,
      -0.2040259, 1.0572252;
  return rgb_from_xyz * xyz;
}

// The color of a gray after the light's color temperature and its distance from the black bodies
// move away from D65; luminance stays. Channels are scaled in linear light.
Eigen::Matrix3f WhiteBalance(float temperature, float tint) {
  constexpr double kDaylight = 1e6 / 6504;  // D65, mired
  constexpr double kTintStep = 3e-4;        // in u, v
  const Eigen::Vector2d daylight(0.19783, 0.31222);
  const Eigen::Vector2d here = BlackBody(kDaylight);
  const Eigen::Vector2d tangent = BlackBody(kDaylight + 1) - here;
  const Eigen::Vector2d across = Eigen::Vector2d(tangent[1], -tangent[0]).normalized();
  const Eigen::Vector2d magenta = across[1] < 0 ? across : Eigen::Vector2d(-across);
  const Eigen::Vector2d white = daylight + (BlackBody(kDaylight + double(temperature)) - here) +
                                kTintStep * double(tint) * magenta;
  Eigen::Vector3d gain =
      LinearOfChromaticity(white).cwiseQuotient(LinearOfChromaticity(daylight)).cwiseMax(0.0);
  gain /= 0.2126 * gain[0] + 0.7152 * gain[1] + 0.0722 * gain[2];
  return gain.cast<float>().asDiagonal();
}

void SetLinearMatrix(const Eigen::Matrix3f& matrix, ColorOp& out) {
  out.code = ColorOpCode::kLinearMatrix;
  for (int i = 0; i < 9; ++i) out.values[i] = matrix(i / 3, i % 3);
}

void CompileAdjust(const ColorOperation& op, ColorOp& out) {
  constexpr float kDegree = std::numbers::pi_v<float> / 180;
  out.code = ColorOpCode::kAdjust;
  const float turn = op.Get("hue")[0] * kDegree;
  const auto hues = op.Get("hues");
  float extent = hues[1] - hues[0];
  if (extent < 0) extent += 360;
  const float values[] = {std::cos(turn),
                          std::sin(turn),
                          op.Get("chroma")[0],
                          op.Get("lightness")[0],
                          hues[0] * kDegree,
                          extent >= 360 ? 7.0f : extent * kDegree,  // above a whole turn
                          op.Get("hue_edge")[0] * kDegree,
                          op.Get("chromas")[0],
                          op.Get("chromas")[1],
                          op.Get("lightnesses")[0],
                          op.Get("lightnesses")[1],
                          op.Get("edge")[0]};
  std::copy(std::begin(values), std::end(values), out.values);
}

struct LightColor {
  Eigen::Vector3f linear;
  float lightness;
};

float LightnessOf(const Eigen::Vector3f& linear) { return std::cbrt(Luminance(linear.data())); }

// The color, so dark that at least `room` of the lightness is left to white.
LightColor WithRoom(const Eigen::Vector3f& linear, float room) {
  const float lightness = LightnessOf(linear);
  if (lightness <= 1 - room) return {linear, lightness};
  const float darker = (1 - room) / lightness;
  return {darker * darker * darker * linear, 1 - room};
}

// See RecolorColor.
void CompileRecolor(const ColorOperation& op, ColorOp& out) {
  constexpr float kLeast = 1e-3f;  // of the main color, so that black can be recolored
  // A pale main color is too near to white for gloss to be told from pale texture.
  constexpr float kPale = 0.5f, kColored = 1;  // squared distances of white from it
  constexpr float kHueVariation = 0.2f;        // exponent
  constexpr float kMostLight = 1.5f;           // times the brightest body color measured
  constexpr float kRoom = 0.02f;               // lightness between the lightest target and white
  constexpr float kGrayChroma = 1e-3f;
  if (!op.IsSet("from")) {
    throw OptionError("the region's main color is not measured here: name it, as in " +
                      OptionName("to", "'#3060ff,from=#c8b478'") +
                      ", or take the edit from a report, " + OptionName("edit", "report.json"));
  }
  const auto scene = [](const Eigen::Vector3f& display) {
    return Eigen::Vector3f(display.unaryExpr([](float y) { return SceneFromDisplay(y); }));
  };
  const Eigen::Vector3f shown = LinearOf(op.Get("from"));
  const auto [target, lightness] = WithRoom(LinearOf(op.Get("to")), kRoom);
  const Eigen::Vector3f from = scene(shown).cwiseMax(kLeast), to = scene(target);
  const float luminance = Luminance(from.data());
  const Eigen::Vector3f main = from / luminance;
  const Eigen::Vector3f white = Eigen::Vector3f::Ones() - main * (main.sum() / main.squaredNorm());
  const float distance = white.squaredNorm();
  // A gray target takes no hues, a pale one takes paler ones.
  const auto chroma = [](const Eigen::Vector3f& color) {
    const OkLab lab = OkLabFromLinear(color.data());
    return std::hypot(lab.a, lab.b);
  };
  const float paler = std::min(chroma(to) / std::max(chroma(from), kGrayChroma), 1.0f);
  float limit = 1e6f, half_way = 1 - lightness;
  if (op.IsSet("brightest")) {
    const Eigen::Vector3f brightest = scene((op.Get("brightest")[0] * shown).cwiseMin(1.0f));
    limit = kMostLight * std::max(Luminance(brightest.data()) / luminance, 1.0f);
    const Eigen::Vector3f lit = (limit * to).unaryExpr([](float x) { return DisplayFromScene(x); });
    half_way = std::max(LightnessOf(lit) - lightness, half_way);
  }
  out.code = ColorOpCode::kRecolor;
  for (int c = 0; c < 3; ++c) {
    out.values[c] = main[c];
    out.values[3 + c] = to[c];
    out.values[6 + c] = white[c] / std::max(distance, kLeast);
  }
  out.values[9] = SmoothStep(kPale, kColored, distance);
  out.values[10] = luminance;
  out.values[11] = Luminance(to.data());
  out.values[12] = kHueVariation * paler;
  out.values[13] = limit;
  out.values[14] = op.Get("keep_lightness")[0];
  out.values[15] = lightness;
  out.values[16] = half_way;
}

// Between the stops straight in OKLab.
std::vector<float> GradientTable(std::span<const float> stops, int size) {
  std::vector<float> table;
  for (int i = 0; i < size; ++i) {
    const float at = float(i) / float(size - 1);
    size_t next = 0;
    while (next < stops.size() && stops[next] <= at) next += 4;
    const size_t high = std::min(next, stops.size() - 4), low = next == 0 ? 0 : next - 4;
    const float width = stops[high] - stops[low];
    const float t = width > 0 ? (at - stops[low]) / width : 0;
    const OkLab x = OkLabFromSrgb(&stops[low + 1]), y = OkLabFromSrgb(&stops[high + 1]);
    float rgb[3];
    SrgbFromOkLab({x.lightness + t * (y.lightness - x.lightness), x.a + t * (y.a - x.a),
                   x.b + t * (y.b - x.b)},
                  rgb);
    table.insert(table.end(), rgb, rgb + 3);
  }
  return table;
}

// See MovePalette.
std::vector<float> PaletteTable(std::span<const float> pairs) {
  constexpr float kLeast = 0.02f;     // lightness, so that black can be moved
  constexpr float kMostContrast = 2;  // lightness is spread by no more; the rest is added
  // If more would be needed, colors move towards the scale that leaves white white, the more the
  // darker the color was: in its light, everything else would become white too.
  const auto contrast = [&](float from, float to) {
    const float wanted = to / std::max(from, kLeast);
    if (wanted <= kMostContrast) return wanted;
    const float share = (kMostContrast / wanted) * (kMostContrast / wanted);
    return share * kMostContrast + (1 - share) * (1 - to) / (1 - from);
  };
  std::vector<float> table;
  for (size_t i = 0; i < pairs.size(); i += kPairValues) {
    if (pairs[i] == kUnset) {
      throw OptionError("the region's main colors are not measured here: name them all, as in " +
                        OptionName("palette", "'#c8b478=#3060ff,#405030'") +
                        ", or take the edit from a report, " + OptionName("edit", "report.json"));
    }
    const OkLab from = OkLabFromSrgb(&pairs[i]);
    const float* target = &pairs[i + 3];
    float scale = 1, offset = 0, a = 0, b = 0;
    if (*target != kUnset) {
      const OkLab to = OkLabFromSrgb(target);
      scale = contrast(from.lightness, to.lightness);
      offset = to.lightness - scale * from.lightness;
      const float light = std::max(to.lightness, kLeast);
      a = (to.a - scale * from.a) / light;
      b = (to.b - scale * from.b) / light;
    }
    table.insert(table.end(), {from.lightness, from.a, from.b, scale, offset, a, b});
  }
  return table;
}

}  // namespace

std::span<const ColorOperationType> ColorOperationTypes() { return kTypes; }

const ColorOperationType& TypeOf(ColorOperationKind kind) { return kTypes[size_t(kind)]; }

const ColorOperationType* FindOperationType(std::string_view name) {
  for (const ColorOperationType& type : kTypes) {
    if (name == type.name) return &type;
  }
  return nullptr;
}

std::optional<AffineColor> FullAffine(const ColorOperation& op) {
  AffineColor map;
  switch (op.kind) {
    case Kind::kTint: {
      map.gain = Eigen::Map<const Eigen::Vector3f>(op.values.data()).asDiagonal();
      return map;
    }
    case Kind::kMatrix:
      for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) {
          map.gain(row, column) = op.values[size_t(4 * row + column)];
        }
        map.offset[row] = op.values[size_t(4 * row + 3)];
      }
      return map;
    case Kind::kContrast: {
      const float factor = op.values[0], pivot = op.values[1];
      map.gain *= factor;
      map.offset.setConstant(pivot * (1 - factor));
      return map;
    }
    case Kind::kSaturation:
      map.gain = op.values[0] * kIdentity + (1 - op.values[0]) * (Eigen::Vector3f::Ones() * kLuma);
      return map;
    case Kind::kPicture:  // without a table, the colors that were not painted stay
      if (op.table) return std::nullopt;
      return map;
    case Kind::kInvert:
      map.gain = -kIdentity;
      map.offset.setOnes();
      return map;
    default:
      return std::nullopt;
  }
}

ColorOp Compile(const ColorOperation& op, std::vector<float>& tables) {
  constexpr int kGradientSize = 256;
  ColorOp out{};
  out.strength = op.strength;
  const auto add_table = [&](ColorOpCode code, int size, const std::vector<float>& values) {
    out.code = code;
    out.table = int32_t(tables.size());
    out.size = size;
    tables.insert(tables.end(), values.begin(), values.end());
  };
  if (const auto map = FullAffine(op)) {
    out.code = ColorOpCode::kMatrix;
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) {
        out.values[4 * row + column] = map->gain(row, column);
      }
      out.values[4 * row + 3] = map->offset[row];
    }
    return out;
  }
  switch (op.kind) {
    case Kind::kExposure:
      SetLinearMatrix(kIdentity * std::exp2(op.values[0]), out);
      break;
    case Kind::kGamma:
      out.code = ColorOpCode::kPower;
      out.values[0] = 1 / op.values[0];
      break;
    case Kind::kWhiteBalance:
      SetLinearMatrix(WhiteBalance(op.values[0], op.values[1]), out);
      break;
    case Kind::kGray:
      SetLinearMatrix(Eigen::Vector3f::Ones() * kLuma, out);
      break;
    case Kind::kAdjust:
      CompileAdjust(op, out);
      break;
    case Kind::kRecolor:
      CompileRecolor(op, out);
      break;
    case Kind::kGradient:
      add_table(ColorOpCode::kGradient, kGradientSize, GradientTable(op.values, kGradientSize));
      break;
    case Kind::kPalette:
      add_table(ColorOpCode::kPalette, int(op.values.size() / kPairValues),
                PaletteTable(op.values));
      out.values[0] = kPaletteLightnessWeight;
      break;
    case Kind::kLut:
    case Kind::kPicture:
      add_table(ColorOpCode::kTable, op.table->size, op.table->values);
      break;
    default:
      out.code = ColorOpCode::kSoftClip;
      out.values[0] = op.values[0];
  }
  return out;
}

}  // namespace retint
