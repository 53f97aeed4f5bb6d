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
  const size_t most = size_t(type.parameters[0].count);
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
