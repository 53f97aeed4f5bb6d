// SPDX-License-Identifier: BSD-3-Clause
// The operations that an edit is made of, as values, and the one table that
// describes them: their names and parameters in files, on the command line and
// in messages.
#pragma once

#include <initializer_list>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "base/option.h"
#include "recolor/lut.h"
#include "recolor/picture_edit.h"

namespace retint {

enum class ColorOperationKind {
  kTint,
  kMatrix,
  kExposure,
  kContrast,
  kGamma,
  kWhiteBalance,
  kSaturation,
  kInvert,
  kGray,
  kAdjust,
  kRecolor,
  kGradient,
  kPalette,
  kLut,
  kPicture,
  kSoftClip,
};

// An optional parameter without a value: its value is found out later.
inline constexpr float kUnset = -1;

struct ColorParameter {
  // A color: 3 numbers, #rrggbb or a name. Lists of any length, which are all of an operation's
  // values: stops, each a place and a color; pairs, each a color and its new color.
  enum class Form { kNumbers, kColor, kStops, kPairs };
  const char* name;  // in JSON; on the command line with - for _
  int count;         // of values; lists: the most that there may be
  float initial;     // each value's default
  float min, max;
  bool required = false;  // must be given; else `initial` holds
  Form form = Form::kNumbers;

  bool IsList() const { return form == Form::kStops || form == Form::kPairs; }
};

// Values of a palette's pair: the color, kUnset until it is measured; the color that it becomes,
// kUnset where it stays.
inline constexpr size_t kPairValues = 6;

struct ColorOperationType {
  ColorOperationKind kind;
  const char* name;    // in JSON
  const char* option;  // on the command line, without --
  const char* syntax;  // of the option's value; empty: a flag
  const char* help;
  std::span<const ColorParameter> parameters;
  OptionTier tier = OptionTier::kOccasional;
};

// In the order of ColorOperationKind.
std::span<const ColorOperationType> ColorOperationTypes();
const ColorOperationType& TypeOf(ColorOperationKind kind);
const ColorOperationType* FindOperationType(std::string_view name);  // null: there is none

// One operation on colors. Colors are display-referred sRGB, 0 to 1.
struct ColorOperation {
  ColorOperationKind kind = ColorOperationKind::kMatrix;
  float strength = 1;                          // 0 to 1: color + strength (op(color) - color)
  std::vector<float> values;                   // of the type's parameters, one after the other
  std::shared_ptr<const ColorTable> table;     // kLut's; kPicture's color map, where it has one
  std::shared_ptr<const PictureEdit> picture;  // kPicture's

  // With the type's defaults, of which `first` replaces the first values.
  static ColorOperation Make(ColorOperationKind kind, std::initializer_list<float> first = {});
  static ColorOperation Lut(std::shared_ptr<const ColorTable> table);
  // kPalette's, of `count` colors that are yet to be measured and stay.
  static ColorOperation Palette(int count);

  // The values of one parameter. Precondition: the type has it.
  std::span<const float> Get(std::string_view parameter) const;
  std::span<float> Get(std::string_view parameter);
  bool IsSet(std::string_view parameter) const { return Get(parameter)[0] != kUnset; }
  // kPicture's, whose pictures are yet to be compared with the scene.
  static ColorOperation Picture(std::vector<EditedPicture> pictures);
  // Whether it waits for colors of the region that it will be applied to.
  bool NeedsMeasuring() const;

  // OptionError naming operation and parameter: out of range, not finite, an
  // empty range.
  void Check() const;
  bool operator==(const ColorOperation& other) const;
};

}  // namespace retint
