// SPDX-License-Identifier: BSD-3-Clause
#include "recolor/edit_text.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "base/error.h"
#include "base/files.h"
#include "recolor/operation_text.h"
#include "recolor/palette.h"

namespace retint {
namespace {

using Kind = ColorOperationKind;

// [AT:]COLOR,...
std::vector<float> ParseStops(const OperationText& text,
                              const std::vector<std::string_view>& words) {
  std::vector<float> stops;
  size_t placed = 0;
  for (size_t i = 0; i < words.size(); ++i) {
    const auto colon = words[i].find(':');
    const bool has_place = colon != std::string_view::npos;
    placed += has_place;
    const float even = words.size() > 1 ? float(i) / float(words.size() - 1) : 0.0f;
    stops.push_back(has_place ? text.Number(Trimmed(words[i].substr(0, colon))) : even);
    const std::string_view color = has_place ? Trimmed(words[i].substr(colon + 1)) : words[i];
    text.AddColor(color, stops);
  }
  if (placed != 0 && placed != words.size()) text.Fail("either all colors have a place or none");
  return stops;
}

// "K,INDEX=COLOR,..." or "COLOR[=COLOR],...", a strength left out. Gives every pair.
std::vector<float> ParsePairs(const OperationText& text,
                              const std::vector<std::string_view>& words) {
  std::vector<float> pairs;
  const auto add_color = [&](std::string_view word, float* to) {
    std::vector<float> values;
    text.AddColor(word, values);
    std::copy(values.begin(), values.end(), to);
  };
  const bool measured = !words.empty() && !MayBeColor(words[0]);
  bool changed = false;
  for (size_t i = 0; i < words.size(); ++i) {
    const auto equals = words[i].find('=');
    const std::string_view key = Trimmed(words[i].substr(0, equals));
    const bool has_target = equals != std::string_view::npos;
    size_t at = i * kPairValues;
    if (measured) {
      const float number = text.Number(key);
      const float most = i == 0 ? float(kMaxPaletteColors) : float(pairs.size() / kPairValues);
      if (i == 0 && has_target) text.Fail("the number of colors comes first");
      if (i > 0 && !has_target) text.Fail(std::string("'").append(key).append("' has no color"));
      if (!(number >= 1 && number <= most) || number != std::floor(number)) {
        text.Fail(std::string(i == 0 ? "the number of colors" : "an index")
                      .append(" must be from 1 to ")
                      .append(std::to_string(int(most)))
                      .append(", not ")
                      .append(key));
      }
      if (i == 0) pairs = ColorOperation::Palette(int(number)).values;
      at = size_t(number - 1) * kPairValues;
      if (i > 0 && pairs[at + 3] != kUnset) {
        text.Fail(std::string("changes color ").append(key).append(" twice"));
      }
    } else {
      pairs.insert(pairs.end(), kPairValues, kUnset);
      add_color(key, &pairs[at]);
    }
    if (!has_target) continue;
    add_color(Trimmed(words[i].substr(equals + 1)), &pairs[at + 3]);
    changed = true;
  }
  if (!changed) text.Fail("changes no color");
  return pairs;
}

struct FileOption {
  std::filesystem::path file;
  float strength = 1;
};

constexpr std::string_view kStrength = ",strength=";

FileOption FileAndStrength(const OperationText& text, std::string_view words) {
  const std::string_view file = FileOf(words);
  if (Trimmed(file).empty()) text.Fail("names no file");
  if (file.size() == words.size()) return {std::filesystem::path(file)};
  const float strength = text.Number(Trimmed(words.substr(file.size() + kStrength.size())));
  if (!(strength >= 0 && strength <= 1)) text.Fail("strength must be from 0 to 1");
  return {std::filesystem::path(file), strength};
}

}  // namespace

std::string_view FileOf(std::string_view text) {
  const auto at = text.rfind(kStrength);
  const bool whole = at == std::string_view::npos || IsFile(std::filesystem::path(text));
  return whole ? text : text.substr(0, at);
}

ColorOperation ParseOperation(const ColorOperationType& type, std::string_view text,
                              std::vector<std::string>* warnings) {
  const OperationText reader(type, text);
  if (type.kind == Kind::kLut) {
    const auto [file, strength] = FileAndStrength(reader, text);
    ColorOperation lut = ColorOperation::Lut(ReadLut(file));
    lut.strength = strength;
    return lut;
  }
  if (type.kind == Kind::kPicture) {
    const auto equals = text.find('=');
    if (equals == std::string_view::npos || equals == 0 || equals + 1 == text.size()) {
      reader.Fail("names no view and picture");
    }
    const auto [file, strength] = FileAndStrength(reader, text.substr(equals + 1));
    ColorOperation picture =
        ColorOperation::Picture({{std::string(text.substr(0, equals)), file, {}}});
    picture.strength = strength;
    return picture;
  }
  ColorOperation op = ColorOperation::Make(type.kind);
  std::vector<std::string_view> plain;  // without a key
  std::vector<std::string> keys;
  const auto has = [&](std::string_view key) {
    return std::find(keys.begin(), keys.end(), key) != keys.end();
  };
  for (const std::string_view word : Split(text, ',')) {
    const auto equals = word.find('=');
    const bool of_list = type.kind == Kind::kPalette && !word.starts_with("strength");
    if (equals == std::string_view::npos || of_list) {
      if (!word.empty() || *type.syntax != 0) plain.push_back(word);
      continue;
    }
    std::string key(Trimmed(word.substr(0, equals)));
    std::replace(key.begin(), key.end(), '-', '_');
    const std::string_view value = Trimmed(word.substr(equals + 1));
    const ColorParameter* parameter = FindParameter(type, key);
    if (has(key)) reader.Fail("has '" + key + "' twice");
    if (key == "strength") {
      op.strength = reader.Number(value);
    } else if (key == kGrayKey && type.kind == Kind::kWhiteBalance) {
      std::vector<float> gray;
      reader.AddColor(value, gray);
      SetGray(gray, op, warnings);
    } else if (!parameter || parameter->IsList()) {
      reader.Fail("there is no '" + key + "'");
    } else {
      Set(op, *parameter, reader.Values(value, *parameter));
    }
    keys.push_back(key);
  }
  if (has(kGrayKey) && (!plain.empty() || has("temperature") || has("tint"))) {
    reader.Fail("gray stands for temperature and tint");
  }
  if (type.kind == Kind::kGradient || type.kind == Kind::kPalette) {
    op.values =
        type.kind == Kind::kGradient ? ParseStops(reader, plain) : ParsePairs(reader, plain);
    plain.clear();
  }
  std::vector<float> values;
  for (const std::string_view word : plain) {
    std::string key(word);
    std::replace(key.begin(), key.end(), '-', '_');
    if (FindParameter(type, key)) {
      reader.Fail(fmt::format("'{0}' has no value; give it as {0}=VALUE", word));
    }
    const bool is_color = !type.parameters.empty() && values.size() < 3 &&
                          type.parameters.front().form == ColorParameter::Form::kColor;
    if (is_color && MayBeColor(word)) {
      reader.AddColor(word, values);
    } else {
      values.push_back(reader.Number(word, is_color ? "color" : "number"));
    }
  }
  size_t used = 0;
  for (const ColorParameter& parameter : type.parameters) {
    const size_t count = size_t(parameter.count);
    if (parameter.IsList() || (has(parameter.name) && used == values.size())) continue;
    if (has(parameter.name)) reader.Fail(std::string("has '") + parameter.name + "' twice");
    if (used == values.size() && !parameter.required) break;
    if (values.size() - used < count) {
      reader.Fail(std::string("needs ") + std::to_string(count) + " value" +
                  (count == 1 ? "" : "s"));
    }
    std::copy_n(values.begin() + ptrdiff_t(used), count, op.Get(parameter.name).begin());
    used += count;
  }
  if (used != values.size()) reader.Fail("has too many values");
  if (type.kind == Kind::kAdjust && keys.empty()) reader.Fail("adjusts nothing");
  try {
    op.Check();
  } catch (const OptionError& error) {
    reader.Fail(error.what());
  }
  return op;
}

}  // namespace retint
