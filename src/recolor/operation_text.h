// SPDX-License-Identifier: BSD-3-Clause
// Shared by the readers of operations, from the command line and from JSON. Internal to recolor.
#pragma once

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include "base/error.h"
#include "base/option_name.h"
#include "recolor/color_name.h"
#include "recolor/color_operation.h"
#include "recolor/white_balance.h"

namespace retint {

inline std::string_view Trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

inline std::vector<std::string_view> Split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  for (;;) {
    const auto at = text.find(separator);
    parts.push_back(Trimmed(text.substr(0, at)));
    if (at == std::string_view::npos) return parts;
    text.remove_prefix(at + 1);
  }
}

// The text of an operation, for messages, and the reading of its values.
class OperationText {
 public:
  OperationText(const ColorOperationType& type, std::string_view text) : type_(type), text_(text) {}

  [[noreturn]] void Fail(const std::string& why) const {
    throw OptionError(OptionName(type_.option) + " '" + std::string(text_) + "': " + why +
                      (*type_.syntax != 0 ? std::string(" (expected ") + type_.syntax + ")" : ""));
  }

  // `kind`: of value that the word would be, for the message.
  float Number(std::string_view word, const char* kind = "number") const {
    float value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error == std::errc::result_out_of_range) {
      Fail(std::string("'").append(word).append("' is out of range"));
    }
    if (error != std::errc() || end != word.data() + word.size() || word.empty()) {
      Fail(std::string("'").append(word).append("' is not a ").append(kind));
    }
    if (!std::isfinite(value)) Fail("holds a value that is not finite");
    return value + 0.0f;  // -0 becomes 0
  }

  // The three values of #rrggbb or a name.
  void AddColor(std::string_view word, std::vector<float>& values) const {
    std::array<float, 3> color;
    const std::string fault = ReadColor(word, &color);
    if (!fault.empty()) Fail(fault);
    values.insert(values.end(), color.begin(), color.end());
  }

  std::vector<float> Values(std::string_view words, const ColorParameter& parameter) const {
    std::vector<float> values;
    for (const std::string_view word : Split(words, ':')) {
      const bool is_color = parameter.form == ColorParameter::Form::kColor;
      if (is_color && MayBeColor(word)) {
        AddColor(word, values);
      } else {
        values.push_back(Number(word, is_color ? "color" : "number"));
      }
    }
    if (values.size() != size_t(parameter.count)) {
      Fail(std::string(parameter.name) + " needs " + std::to_string(parameter.count) + " value" +
           (parameter.count == 1 ? "" : "s"));
    }
    return values;
  }

 private:
  const ColorOperationType& type_;
  std::string_view text_;
};

inline const ColorParameter* FindParameter(const ColorOperationType& type, std::string_view name) {
  for (const ColorParameter& parameter : type.parameters) {
    if (name == parameter.name) return &parameter;
  }
  return nullptr;
}

// A white balance may have this instead of its parameters: the color that becomes gray.
inline constexpr std::string_view kGrayKey = "gray";

// A warning about it is added to `warnings`, unless that is null.
inline void SetGray(const std::vector<float>& gray, ColorOperation& op,
                    std::vector<std::string>* warnings) {
  const GrayBalance found = WhiteBalanceOfGray(gray);
  op.Get("temperature")[0] = found.temperature;
  op.Get("tint")[0] = found.tint;
  if (warnings && !found.warning.empty()) warnings->push_back(found.warning);
}

inline void Set(ColorOperation& op, const ColorParameter& parameter,
                const std::vector<float>& values) {
  if (parameter.IsList()) {
    op.values = values;
  } else {
    std::copy(values.begin(), values.end(), op.Get(parameter.name).begin());
  }
}

}  // namespace retint
