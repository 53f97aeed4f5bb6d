// SPDX-License-Identifier: BSD-3-Clause
#include "recolor/color_edit.h"

#include <charconv>
#include <cmath>
#include <string>

#include "base/error.h"

namespace retint {
namespace {

[[noreturn]] void BadTint(std::string_view text, const char* why) {
  throw OptionError("tint '" + std::string(text) + "': " + why +
                    " (expected R,G,B with numbers >= 0, or #rrggbb)");
}

int HexDigit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

Eigen::Vector3f ParseHex(std::string_view text, std::string_view digits) {
  if (digits.size() != 6) BadTint(text, "needs six hexadecimal digits");
  Eigen::Vector3f tint;
  for (int c = 0; c < 3; ++c) {
    const int high = HexDigit(digits[size_t(2 * c)]), low = HexDigit(digits[size_t(2 * c + 1)]);
    if (high < 0 || low < 0) BadTint(text, "holds a character that is not a hexadecimal digit");
    tint[c] = float(16 * high + low) / 255.0f;
  }
  return tint;
}

std::string_view Trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

}  // namespace

ColorEdit ColorEdit::Tint(const Eigen::Vector3f& tint) {
  ColorEdit edit;
  edit.gain = tint.asDiagonal();
  return edit;
}

ColorEdit ColorEdit::WithStrength(float strength) const {
  const Eigen::Matrix3f identity = Eigen::Matrix3f::Identity();
  ColorEdit edit;
  edit.gain = identity + strength * (gain - identity);
  edit.offset = strength * offset;
  return edit;
}

void ColorEdit::Check() const {
  CheckOption(gain.allFinite() && offset.allFinite(), "edit: NaN or infinite value");
  CheckOption(gain.minCoeff() >= 0 && offset.minCoeff() >= 0, "edit: negative value");
}

ColorEdit ParseTint(std::string_view text) {
  const std::string_view trimmed = Trimmed(text);
  if (trimmed.empty()) BadTint(text, "is empty");
  Eigen::Vector3f tint;
  if (trimmed.front() == '#') {
    tint = ParseHex(text, trimmed.substr(1));
  } else {
    std::string_view rest = trimmed;
    for (int c = 0; c < 3; ++c) {
      const auto comma = rest.find(',');
      if ((comma == std::string_view::npos) != (c == 2)) BadTint(text, "needs three values");
      const std::string_view field = Trimmed(rest.substr(0, comma));
      const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), tint[c]);
      if (error != std::errc() || end != field.data() + field.size() || field.empty()) {
        BadTint(text, "holds something that is not a number");
      }
      if (!std::isfinite(tint[c])) BadTint(text, "holds a value that is not finite");
      if (tint[c] < 0) BadTint(text, "holds a negative value");
      tint[c] += 0.0f;  // -0 becomes 0
      if (c < 2) rest = rest.substr(comma + 1);
    }
  }
  const ColorEdit edit = ColorEdit::Tint(tint);
  edit.Check();
  return edit;
}

}  // namespace retint
