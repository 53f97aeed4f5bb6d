// SPDX-License-Identifier: BSD-3-Clause
#include "base/escaped_bytes.h"

#include "base/printable.h"

#include <algorithm>
#include <cctype>

namespace retint {
namespace {

// Bytes of the UTF-8 character that `text` begins with; 0: it begins with none.
size_t LengthOfCharacter(std::string_view text) {
  const auto lead = static_cast<unsigned char>(text[0]);
  if (lead < 0x80) return 1;
  if (lead < 0xC2 || lead > 0xF4) return 0;
  const size_t length = lead < 0xE0 ? 2 : lead < 0xF0 ? 3 : 4;
  if (text.size() < length) return 0;
  for (size_t k = 1; k < length; ++k) {
    if ((static_cast<unsigned char>(text[k]) & 0xC0) != 0x80) return 0;
  }
  // Overlong forms, surrogates, beyond U+10FFFF.
  const auto next = static_cast<unsigned char>(text[1]);
  const bool wrong = (lead == 0xE0 && next < 0xA0) || (lead == 0xED && next > 0x9F) ||
                     (lead == 0xF0 && next < 0x90) || (lead == 0xF4 && next > 0x8F);
  return wrong ? 0 : length;
}

bool IsUtf8(std::string_view text) {
  while (!text.empty()) {
    const size_t length = LengthOfCharacter(text);
    if (length == 0) return false;
    text.remove_prefix(length);
  }
  return true;
}

constexpr char kDigits[] = "0123456789ABCDEF";

std::string Hex(unsigned char value) { return {kDigits[value >> 4], kDigits[value & 15]}; }

}  // namespace

int HexValue(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

std::string EscapeBytes(std::string_view bytes) {
  const bool utf8 = IsUtf8(bytes);
  std::string text;
  for (const char c : bytes) {
    const auto value = static_cast<unsigned char>(c);
    if (c != '%' && value >= 0x20 && (value < 0x80 || utf8) && value != 0x7F) {
      text += c;
      continue;
    }
    text += '%' + Hex(value);
  }
  return text;
}

std::string Printable(std::string_view text) {
  constexpr unsigned char kDelete = 0x7F, kLeadOfC1 = 0xC2;
  std::string shown;
  while (!text.empty()) {
    const size_t length = LengthOfCharacter(text);
    const auto first = static_cast<unsigned char>(text[0]);
    const auto last = static_cast<unsigned char>(text[length > 0 ? length - 1 : 0]);
    const bool is_control =
        length == 1 ? first < 0x20 || first == kDelete : first == kLeadOfC1 && last < 0xA0;
    if (length == 0) {
      shown += "<0x" + Hex(first) + ">";
    } else if (is_control) {
      shown += "<U+00" + Hex(last) + ">";
    } else {
      shown += text.substr(0, length);
    }
    text.remove_prefix(std::max<size_t>(length, 1));
  }
  return shown;
}

std::string UnescapeBytes(std::string_view text) {
  std::string bytes;
  for (size_t i = 0; i < text.size(); ++i) {
    const int high = text[i] == '%' && i + 2 < text.size() ? HexValue(text[i + 1]) : -1;
    const int low = high >= 0 ? HexValue(text[i + 2]) : -1;
    if (low < 0) {
      bytes += text[i];
      continue;
    }
    bytes += static_cast<char>(16 * high + low);
    i += 2;
  }
  return bytes;
}

std::string OneLine(std::string_view text) {
  std::string line;
  for (const char c : text) {
    const bool space = std::isspace(static_cast<unsigned char>(c)) != 0;
    if (!space) line += c;
    if (space && !line.empty() && line.back() != ' ') line += ' ';
  }
  while (!line.empty() && line.back() == ' ') line.pop_back();
  return line;
}

}  // namespace retint
