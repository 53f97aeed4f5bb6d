// SPDX-License-Identifier: BSD-3-Clause
#include "base/ply_body.h"

#include <algorithm>
#include <charconv>
#include <string>
#include <utility>

namespace retint {
namespace {

constexpr double kLongestList = 1e9;

bool IsSpace(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }

// ParsePlyHeader() let nothing else through.
PlyType TypeOf(std::string_view name) {
  static constexpr std::pair<std::string_view, PlyType> kTypes[] = {
      {"char", PlyType::kInt8},     {"int8", PlyType::kInt8},     {"uchar", PlyType::kUint8},
      {"uint8", PlyType::kUint8},   {"short", PlyType::kInt16},   {"int16", PlyType::kInt16},
      {"ushort", PlyType::kUint16}, {"uint16", PlyType::kUint16}, {"int", PlyType::kInt32},
      {"int32", PlyType::kInt32},   {"uint", PlyType::kUint32},   {"uint32", PlyType::kUint32},
      {"float", PlyType::kFloat},   {"float32", PlyType::kFloat}};
  for (const auto& [known, type] : kTypes) {
    if (known == name) return type;
  }
  return PlyType::kDouble;
}

uint64_t BytesOf(PlyType type) {
  constexpr uint64_t kBytes[] = {1, 1, 2, 2, 4, 4, 4, 8};
  return kBytes[static_cast<int>(type)];
}

}  // namespace

PlyColumn ColumnOf(const PlyProperty& property) {
  constexpr std::string_view kList = "list ";
  const std::string_view type = property.type;
  if (!type.starts_with(kList)) return {TypeOf(type), std::nullopt};
  const size_t space = type.find(' ', kList.size());
  return {TypeOf(type.substr(space + 1)), TypeOf(type.substr(kList.size(), space - kList.size()))};
}

PlyBody::PlyBody(std::string_view file, const PlyHeader& header, const std::filesystem::path& path)
    : text_(file.substr(header.bytes)), line_(header.lines + 1), reader_(text_, path) {
  if (header.format == "binary_little_endian") {
    format_ = Format::kLittle;
  } else if (header.format == "binary_big_endian") {
    format_ = Format::kBig;
  } else if (header.format != "ascii") {
    throw InputError(path, "unknown PLY format " + header.format.substr(0, 40));
  }
}

double PlyBody::Value(PlyType type) {
  if (format_ == Format::kAscii) return TextValue();
  switch (type) {
    case PlyType::kInt8:
      return Binary<int8_t>();
    case PlyType::kUint8:
      return Binary<uint8_t>();
    case PlyType::kInt16:
      return Binary<int16_t>();
    case PlyType::kUint16:
      return Binary<uint16_t>();
    case PlyType::kInt32:
      return Binary<int32_t>();
    case PlyType::kUint32:
      return Binary<uint32_t>();
    case PlyType::kFloat:
      return Binary<float>();
    case PlyType::kDouble:
      return Binary<double>();
  }
  return 0;
}

void PlyBody::Skip(const PlyColumn& column) {
  const double length = column.list_count ? Value(*column.list_count) : 1;
  if (!(length >= 0 && length < kLongestList)) {
    throw InputError(reader_.Path(), "malformed list length");
  }
  for (double i = 0; i < length; ++i) Value(column.type);
}

void PlyBody::Skip(const PlyElement& element) {
  if (element.properties.empty()) return;
  Require(element);
  for (uint64_t i = 0; i < element.count; ++i) {
    for (const PlyProperty& property : element.properties) Skip(ColumnOf(property));
  }
}

void PlyBody::Require(const PlyElement& element) const {
  uint64_t bytes = 0;
  for (const PlyProperty& property : element.properties) {
    const PlyColumn column = ColumnOf(property);
    bytes += format_ == Format::kAscii ? 2 : BytesOf(column.list_count.value_or(column.type));
  }
  // The last ASCII value may end the file without a separator.
  const uint64_t slack = format_ == Format::kAscii && element.count > 0 ? 1 : 0;
  reader_.Require(element.count - slack, bytes, element.name + " records");
}

template <typename T>
double PlyBody::Binary() {
  T value = reader_.Read<T>("value");
  if (format_ == Format::kBig) {
    char bytes[sizeof(T)];
    std::memcpy(bytes, &value, sizeof(T));
    std::reverse(bytes, bytes + sizeof(T));
    std::memcpy(&value, bytes, sizeof(T));
  }
  return static_cast<double>(value);
}

std::string_view PlyBody::Word() {
  size_t begin = 0;
  while (begin < text_.size() && IsSpace(text_[begin])) line_ += text_[begin++] == '\n';
  size_t end = begin;
  while (end < text_.size() && !IsSpace(text_[end])) ++end;
  const std::string_view word = text_.substr(begin, end - begin);
  text_.remove_prefix(end);
  return word;
}

double PlyBody::TextValue() {
  const std::string_view word = Word();
  if (word.empty()) throw InputError(reader_.Path(), line_, "truncated: a value is missing");
  double value = 0;
  const auto [end, code] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (code != std::errc() || end != word.data() + word.size()) {
    std::string shown(word.substr(0, 40));
    std::replace_if(
        shown.begin(), shown.end(), [](char c) { return c < 0x20 || c > 0x7e; }, '?');
    throw InputError(reader_.Path(), line_, "not a number: " + shown);
  }
  return value;
}

}  // namespace retint
