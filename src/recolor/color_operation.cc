// SPDX-License-Identifier: BSD-3-Clause
#include "recolor/color_operation.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <string>
#include <utility>

#include "base/error.h"
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

[[noreturn]] void Bad(const ColorOperationType& type, const std::string& why) {
  throw OptionError(std::string(type.name) + ": " + why);
}

std::string Number(float value) {
  char text[32];
  std::snprintf(text, sizeof(text), "%g", double(value));
  return text;
}

void CheckRange(const ColorOperation& op, const char* name, bool wraps) {
  const std::span<const float> range = op.Get(name);
  if (wraps ? range[0] == range[1] : range[0] >= range[1]) {
    Bad(TypeOf(op.kind), std::string("the range of ") + name + " is empty: " + Number(range[0]) +
                             " to " + Number(range[1]));
  }
}

void CheckStops(const ColorOperation& op) {
  const ColorOperationType& type = TypeOf(op.kind);
  const size_t most = size_t(kGradient[0].count);
  if (op.values.size() % 4 != 0 || op.values.size() < 8 || op.values.size() > most) {
    Bad(type, "needs 2 to " + std::to_string(most / 4) + " colors");
  }
  for (size_t i = 4; i < op.values.size(); i += 4) {
    if (op.values[i] <= op.values[i - 4]) Bad(type, "positions do not ascend");
  }
}

void CheckPairs(const ColorOperation& op) {
  const ColorOperationType& type = TypeOf(op.kind);
  const size_t count = op.values.size() / kPairValues;
  if (op.values.size() % kPairValues != 0 || count < 1 || count > size_t(kMaxPaletteColors)) {
    Bad(type, "needs 1 to " + std::to_string(kMaxPaletteColors) + " colors");
  }
  const auto color_at = [&](size_t i) { return std::span(op.values).subspan(i, 3); };
  const auto same = [&](size_t i, size_t j) {
    return std::ranges::equal(color_at(i), color_at(j));
  };
  size_t measured = 0;
  for (size_t i = 0; i < op.values.size(); i += 3) {
    const auto color = color_at(i);
    const bool unset =
        std::all_of(color.begin(), color.end(), [](float value) { return value == kUnset; });
    const bool valid = std::all_of(color.begin(), color.end(),
                                   [](float value) { return value >= 0 && value <= 1; });
    if (!unset && !valid) Bad(type, "a color is not from 0 to 1");
    if (i % kPairValues != 0 || unset) continue;
    ++measured;
    for (size_t j = 0; j < i; j += kPairValues) {
      if (same(i, j) && !same(i + 3, j + 3)) Bad(type, "a color is named twice, with two targets");
    }
  }
  if (measured != 0 && measured != count) Bad(type, "some of its colors are measured, some not");
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

ColorOperation ColorOperation::Make(Kind kind, std::initializer_list<float> first) {
  ColorOperation op;
  op.kind = kind;
  for (const ColorParameter& parameter : TypeOf(kind).parameters) {
    if (parameter.IsList()) continue;
    op.values.insert(op.values.end(), size_t(parameter.count), parameter.initial);
  }
  if (kind == Kind::kAdjust) {
    op.Get("hues")[1] = 360;
    op.Get("chromas")[1] = op.Get("lightnesses")[1] = 10;
  }
  if (op.values.size() < first.size()) op.values.resize(first.size());
  std::copy(first.begin(), first.end(), op.values.begin());
  return op;
}

ColorOperation ColorOperation::Lut(std::shared_ptr<const ColorTable> table) {
  ColorOperation op = Make(Kind::kLut);
  op.table = std::move(table);
  return op;
}

ColorOperation ColorOperation::Palette(int count) {
  ColorOperation op = Make(Kind::kPalette);
  op.values.assign(size_t(std::max(count, 0)) * kPairValues, kUnset);
  return op;
}

ColorOperation ColorOperation::Picture(std::vector<EditedPicture> pictures) {
  ColorOperation op = Make(Kind::kPicture);
  op.picture = std::make_shared<PictureEdit>(PictureEdit{std::move(pictures), {}});
  return op;
}

bool ColorOperation::NeedsMeasuring() const {
  return (kind == Kind::kRecolor && !IsSet("from")) ||
         (kind == Kind::kPalette && !values.empty() && values[0] == kUnset) ||
         (kind == Kind::kPicture && !IsSet("explained"));
}

std::span<const float> ColorOperation::Get(std::string_view name) const {
  size_t at = 0;
  for (const ColorParameter& parameter : TypeOf(kind).parameters) {
    if (name == parameter.name) {
      if (parameter.IsList()) return values;
      return std::span(values).subspan(at, size_t(parameter.count));
    }
    at += size_t(parameter.count);
  }
  throw std::logic_error("no such parameter of a color operation");
}

std::span<float> ColorOperation::Get(std::string_view name) {
  const std::span<const float> found = std::as_const(*this).Get(name);
  return {const_cast<float*>(found.data()), found.size()};
}

void ColorOperation::Check() const {
  const ColorOperationType& type = TypeOf(kind);
  if (!(strength >= 0 && strength <= 1)) Bad(type, "strength must be from 0 to 1");
  if (kind != Kind::kPicture && (kind == Kind::kLut) != (table != nullptr)) {
    Bad(type, "has no table, or one too many");
  }
  if ((kind == Kind::kPicture) != (picture != nullptr)) Bad(type, "has no picture");
  if (table) table->Check();
  size_t expected = 0;
  for (const ColorParameter& parameter : type.parameters) expected += size_t(parameter.count);
  if (kind == Kind::kPalette) return CheckPairs(*this);
  if (kind == Kind::kGradient) {
    CheckStops(*this);
  } else if (values.size() != expected) {
    Bad(type, std::to_string(values.size()) + " values, not " + std::to_string(expected));
  }
  for (const ColorParameter& parameter : type.parameters) {
    const bool unset = parameter.initial == kUnset && !IsSet(parameter.name);
    for (const float value : Get(parameter.name)) {
      if (!unset && !(value >= parameter.min && value <= parameter.max)) {
        Bad(type, std::string(parameter.name) + " must be from " + Number(parameter.min) + " to " +
                      Number(parameter.max) + ", not " + Number(value));
      }
    }
  }
  if (kind == Kind::kAdjust) {
    CheckRange(*this, "hues", /*wraps=*/true);
    CheckRange(*this, "chromas", /*wraps=*/false);
    CheckRange(*this, "lightnesses", /*wraps=*/false);
  }
}

bool ColorOperation::operator==(const ColorOperation& other) const {
  const bool same_table = table == other.table || (table && other.table && *table == *other.table);
  const bool same_picture =
      picture == other.picture || (picture && other.picture && *picture == *other.picture);
  return kind == other.kind && strength == other.strength && values == other.values && same_table &&
         same_picture;
}

}  // namespace retint
