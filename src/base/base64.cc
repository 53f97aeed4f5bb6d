// SPDX-License-Identifier: BSD-3-Clause
#include "base/base64.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

namespace retint {
namespace {

constexpr std::string_view kDigits =
    "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

}  // namespace

std::string Base64Encoder::Add(std::string_view bytes) {
  std::string text;
  rest_ += bytes;
  size_t i = 0;
  for (; i + 3 <= rest_.size(); i += 3) {
    const uint32_t word = uint32_t(uint8_t(rest_[i])) << 16 | uint32_t(uint8_t(rest_[i + 1])) << 8 |
                          uint8_t(rest_[i + 2]);
    for (int shift = 18; shift >= 0; shift -= 6) text += kDigits[word >> shift & 63];
  }
  rest_.erase(0, i);
  return text;
}

std::string Base64Encoder::Finish() {
  const size_t left = rest_.size();
  if (left == 0) return "";
  std::string text = Add(std::string(3 - left, '\0'));
  std::fill(text.end() - static_cast<std::ptrdiff_t>(3 - left), text.end(), '=');
  return text;
}

bool DecodeBase64(std::string_view text, std::string& bytes) {
  if (text.size() % 4 != 0) return false;
  while (text.ends_with('=')) text.remove_suffix(1);
  std::array<int8_t, 256> values;
  values.fill(-1);
  for (size_t i = 0; i < kDigits.size(); ++i) {
    values[static_cast<uint8_t>(kDigits[i])] = static_cast<int8_t>(i);
  }
  uint32_t word = 0;
  int bits = 0;
  for (const char c : text) {
    const int value = values[static_cast<uint8_t>(c)];
    if (value < 0) return false;
    word = word << 6 | static_cast<uint32_t>(value);
    bits += 6;
    if (bits < 8) continue;
    bits -= 8;
    bytes += static_cast<char>(word >> bits & 255);
  }
  return true;
}

std::string EncodeBase64(std::string_view bytes) {
  Base64Encoder encoder;
  const std::string text = encoder.Add(bytes);
  return text + encoder.Finish();
}

}  // namespace retint
