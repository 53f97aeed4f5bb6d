// SPDX-License-Identifier: BSD-3-Clause
#include "splat_io/ply_ascii.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>

#include "base/error.h"

namespace retint {
namespace {

constexpr size_t kBlockBytes = size_t{256} << 10;
constexpr size_t kLongestWord = 4096;  // no number is longer

bool IsSpace(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

// A part of the file, safe to show in a one-line message.
std::string Shown(std::string_view word) {
  std::string shown(word.substr(0, 40));
  std::replace_if(
      shown.begin(), shown.end(), [](char c) { return c < 0x20 || c > 0x7e; }, '?');
  return "\"" + shown + (word.size() > 40 ? "...\"" : "\"");
}

// False for text that is not a number of type T. A floating-point number beyond the range of T
// becomes infinite or zero.
template <typename T>
bool Parse(std::string_view word, char* to) {
  if (word.starts_with('+')) word.remove_prefix(1);
  T value{};
  auto [end, code] = std::from_chars(word.data(), word.data() + word.size(), value);
  if constexpr (std::is_floating_point_v<T>) {
    if (code == std::errc::result_out_of_range) {
      // Only numbers with a negative exponent are too small for T.
      const size_t exponent = word.find_first_of("eE");
      const bool tiny = exponent != std::string_view::npos && exponent + 1 < word.size() &&
                        word[exponent + 1] == '-';
      value = tiny ? T{0} : std::numeric_limits<T>::infinity();
      code = {};
    }
  }
  if (code != std::errc{} || end != word.data() + word.size()) return false;
  std::memcpy(to, &value, sizeof(value));
  return true;
}

bool ParseAs(std::string_view type, std::string_view word, char* to) {
  if (type == "float" || type == "float32") return Parse<float>(word, to);
  if (type == "double" || type == "float64") return Parse<double>(word, to);
  if (type == "int" || type == "int32") return Parse<int32_t>(word, to);
  if (type == "uint" || type == "uint32") return Parse<uint32_t>(word, to);
  if (type == "short" || type == "int16") return Parse<int16_t>(word, to);
  if (type == "ushort" || type == "uint16") return Parse<uint16_t>(word, to);
  // For char types, from_chars would read a character.
  int32_t number = 0;
  if (!Parse<int32_t>(word, reinterpret_cast<char*>(&number))) return false;
  const bool is_signed = type == "char" || type == "int8";
  if (number < (is_signed ? -128 : 0) || number > (is_signed ? 127 : 255)) return false;
  *to = static_cast<char>(number);
  return true;
}

// The number of values in a list, from its count of the PLY type `type`; -1: invalid.
int64_t ListLength(std::string_view type, const char* count) {
  const auto as = [&](auto value) {
    std::memcpy(&value, count, sizeof(value));
    return static_cast<int64_t>(value);
  };
  if (type == "uchar" || type == "uint8") return as(uint8_t{});
  if (type == "char" || type == "int8") return as(int8_t{});
  if (type == "ushort" || type == "uint16") return as(uint16_t{});
  if (type == "short" || type == "int16") return as(int16_t{});
  if (type == "uint" || type == "uint32") return as(uint32_t{});
  if (type == "int" || type == "int32") return as(int32_t{});
  return -1;
}

}  // namespace

PlyAscii::PlyAscii(const InputFile& file, const PlyHeader& header)
    : file_(file), offset_(header.bytes), line_(header.lines + 1) {}

void PlyAscii::Fail(const std::string& fault) const {
  throw InputError(file_.path(), line_, fault);
}

bool PlyAscii::Refill() {
  buffer_.erase(0, position_);
  position_ = 0;
  const size_t kept = buffer_.size();
  const auto more = static_cast<size_t>(std::min<uint64_t>(kBlockBytes, file_.size() - offset_));
  buffer_.resize(kept + more);
  file_.ReadAt(offset_, buffer_.data() + kept, more);
  offset_ += more;
  return more > 0;
}

std::string_view PlyAscii::NextWord() {
  while (true) {
    for (; position_ < buffer_.size() && IsSpace(buffer_[position_]); ++position_) {
      line_ += buffer_[position_] == '\n';
    }
    if (position_ < buffer_.size()) break;
    if (!Refill()) return {};
  }
  size_t end = position_;
  while (true) {
    while (end < buffer_.size() && !IsSpace(buffer_[end])) ++end;
    if (end < buffer_.size()) break;
    if (end - position_ > kLongestWord) Fail("expected numbers between spaces");
    end -= position_;
    if (!Refill()) break;
  }
  const std::string_view word(buffer_.data() + position_, end - position_);
  position_ = end;
  return word;
}

void PlyAscii::ReadValue(const std::string& type, const std::string& name, char* to) {
  const std::string_view word = NextWord();
  if (word.empty()) Fail("truncated: " + row_name_ + " lacks " + name);
  if (!ParseAs(type, word, to)) {
    Fail(row_name_ + ": " + name + " is " + Shown(word) + ", expected a number of type " + type);
  }
}

void PlyAscii::ReadRows(const PlyElement& element, size_t first, size_t count,
                        std::vector<char>& to) {
  char* next = to.data();
  for (size_t r = first; r < first + count; ++r) {
    row_name_ = "Gaussian " + std::to_string(r);
    for (const PlyProperty& property : element.properties) {
      ReadValue(property.type, property.name, next);
      next += property.bytes;
    }
  }
}

void PlyAscii::ReadElement(const PlyElement& element, std::vector<char>& to) {
  char value[8];
  const auto append = [&](const std::string& type, const std::string& name) {
    ReadValue(type, name, value);
    to.insert(to.end(), value, value + PlyTypeBytes(type));
  };
  if (element.properties.empty()) return;
  for (uint64_t r = 0; r < element.count; ++r) {
    row_name_ = element.name + " " + std::to_string(r);
    for (const PlyProperty& property : element.properties) {
      if (property.bytes > 0) {
        append(property.type, property.name);
        continue;
      }
      // "list COUNT_TYPE VALUE_TYPE"
      const size_t space = property.type.find(' ', 5);
      const std::string count_type = property.type.substr(5, space - 5);
      append(count_type, property.name);
      const int64_t length = ListLength(count_type, value);
      if (length < 0) Fail(row_name_ + ": " + property.name + " has a wrong number of values");
      for (int64_t i = 0; i < length; ++i) append(property.type.substr(space + 1), property.name);
    }
  }
}

}  // namespace retint
