// SPDX-License-Identifier: BSD-3-Clause
// Clouds as .ply. Reading is table-driven: any element and property may be there, those known are
// used.
#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>

#include "base/error.h"
#include "base/files.h"
#include "selection/neighbors.h"
#include "selection/selection_cloud.h"

namespace retint {
namespace {

namespace fs = std::filesystem;

// View names may hold any byte but a comment is one line: control characters and '%' travel as %XX.
std::string EscapeName(const std::string& name) {
  constexpr char kDigits[] = "0123456789abcdef";
  std::string out;
  for (const char c : name) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte >= 0x20 && byte != 0x7f && c != '%') {
      out += c;
    } else {
      out += {'%', kDigits[byte >> 4], kDigits[byte & 15]};
    }
  }
  return out;
}

std::string UnescapeName(std::string_view text) {
  std::string out;
  for (size_t i = 0; i < text.size(); ++i) {
    unsigned byte = 0;
    if (text[i] == '%' && i + 2 < text.size() &&
        std::from_chars(text.data() + i + 1, text.data() + i + 3, byte, 16).ptr ==
            text.data() + i + 3) {
      out += static_cast<char>(byte);
      i += 2;
    } else {
      out += text[i];
    }
  }
  return out;
}

enum class Format { kAscii, kLittle, kBig };
enum class Type { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat, kDouble };

struct Property {
  std::string name;
  Type type = Type::kFloat;
  std::optional<Type> list_count;  // the type of a list's length
};

struct Element {
  std::string name;
  uint64_t count = 0;
  std::vector<Property> properties;
};

struct Header {
  Format format = Format::kAscii;
  std::vector<Element> elements;
  std::vector<std::string> sources;
};

size_t Bytes(Type type) {
  constexpr size_t kBytes[] = {1, 1, 2, 2, 4, 4, 4, 8};
  return kBytes[static_cast<int>(type)];
}

std::optional<Type> ParseType(std::string_view word) {
  static constexpr std::pair<std::string_view, Type> kTypes[] = {
      {"char", Type::kInt8},     {"int8", Type::kInt8},     {"uchar", Type::kUint8},
      {"uint8", Type::kUint8},   {"short", Type::kInt16},   {"int16", Type::kInt16},
      {"ushort", Type::kUint16}, {"uint16", Type::kUint16}, {"int", Type::kInt32},
      {"int32", Type::kInt32},   {"uint", Type::kUint32},   {"uint32", Type::kUint32},
      {"float", Type::kFloat},   {"float32", Type::kFloat}, {"double", Type::kDouble},
      {"float64", Type::kDouble}};
  for (const auto& [name, type] : kTypes) {
    if (name == word) return type;
  }
  return std::nullopt;
}

// Lines and words of the header and of ASCII bodies; knows the line number for error messages.
class TextCursor {
 public:
  TextCursor(std::string_view text, const fs::path& path) : text_(text), path_(path) {}

  std::string_view Line() {
    if (offset_ >= text_.size()) Fail("truncated header");
    const size_t end = text_.find('\n', offset_);
    if (end == std::string_view::npos) Fail("truncated header");
    std::string_view line = text_.substr(offset_, end - offset_);
    offset_ = end + 1;
    ++line_;
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    return line;
  }
  std::string_view Word() {
    while (offset_ < text_.size() && IsSpace(text_[offset_])) line_ += text_[offset_++] == '\n';
    const size_t begin = offset_;
    while (offset_ < text_.size() && !IsSpace(text_[offset_])) ++offset_;
    if (begin == offset_) Fail("truncated: a value is missing");
    return text_.substr(begin, offset_ - begin);
  }
  [[noreturn]] void Fail(std::string_view fault) const {
    throw InputError(path_, line_ + 1, fault);
  }
  // For faults of the line that Line() returned last.
  [[noreturn]] void FailLine(std::string_view fault) const {
    throw InputError(path_, line_, fault);
  }
  size_t offset() const { return offset_; }

 private:
  static bool IsSpace(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }
  std::string_view text_;
  const fs::path& path_;
  size_t offset_ = 0;
  int64_t line_ = 0;
};

std::vector<std::string_view> Words(std::string_view line) {
  std::vector<std::string_view> words;
  size_t begin = 0;
  while ((begin = line.find_first_not_of(" \t", begin)) != std::string_view::npos) {
    const size_t end = std::min(line.find_first_of(" \t", begin), line.size());
    words.push_back(line.substr(begin, end - begin));
    begin = end;
  }
  return words;
}

void ParseElement(const std::vector<std::string_view>& words, const TextCursor& cursor,
                  Header* header) {
  Element element;
  if (words.size() != 3) cursor.FailLine("malformed element");
  element.name = words[1];
  const auto [end, code] =
      std::from_chars(words[2].data(), words[2].data() + words[2].size(), element.count);
  if (code != std::errc() || end != words[2].data() + words[2].size()) {
    cursor.FailLine("malformed element count");
  }
  header->elements.push_back(std::move(element));
}

void ParseProperty(const std::vector<std::string_view>& words, const TextCursor& cursor,
                   Header* header) {
  Property property;
  const bool is_list = words.size() == 5 && words[1] == "list";
  if (header->elements.empty() || (!is_list && words.size() != 3)) {
    cursor.FailLine("malformed property");
  }
  const auto type = ParseType(words[is_list ? 3 : 1]);
  if (is_list) property.list_count = ParseType(words[2]);
  if (!type || (is_list && !property.list_count)) cursor.FailLine("unknown property type");
  property.type = *type;
  property.name = words.back();
  header->elements.back().properties.push_back(std::move(property));
}

Header ParseHeader(TextCursor& cursor) {
  constexpr std::string_view kSource = "comment source ";
  Header header;
  if (cursor.Line() != "ply") cursor.FailLine("not a .ply file");
  bool has_format = false;
  for (std::string_view line = cursor.Line(); line != "end_header"; line = cursor.Line()) {
    if (line.starts_with(kSource)) {
      header.sources.push_back(UnescapeName(line.substr(kSource.size())));
      continue;
    }
    const auto words = Words(line);
    if (words.empty() || words[0] == "comment" || words[0] == "obj_info") continue;
    if (words[0] == "format" && words.size() == 3) {
      has_format = true;
      if (words[1] == "ascii") {
        header.format = Format::kAscii;
      } else if (words[1] == "binary_little_endian") {
        header.format = Format::kLittle;
      } else if (words[1] == "binary_big_endian") {
        header.format = Format::kBig;
      } else {
        cursor.FailLine("unknown format " + std::string(words[1]));
      }
    } else if (words[0] == "element") {
      ParseElement(words, cursor, &header);
    } else if (words[0] == "property") {
      ParseProperty(words, cursor, &header);
    } else {
      cursor.FailLine("unknown header line");
    }
  }
  if (!has_format) cursor.FailLine("the header names no format");
  return header;
}

// The body, value by value.
class Body {
 public:
  Body(std::string_view text, const fs::path& path, Format format, TextCursor cursor)
      : format_(format), cursor_(cursor), reader_(text.substr(cursor.offset()), path) {}

  double Value(Type type) {
    if (format_ == Format::kAscii) return TextValue();
    switch (type) {
      case Type::kInt8:
        return Binary<int8_t>();
      case Type::kUint8:
        return Binary<uint8_t>();
      case Type::kInt16:
        return Binary<int16_t>();
      case Type::kUint16:
        return Binary<uint16_t>();
      case Type::kInt32:
        return Binary<int32_t>();
      case Type::kUint32:
        return Binary<uint32_t>();
      case Type::kFloat:
        return Binary<float>();
      case Type::kDouble:
        return Binary<double>();
    }
    return 0;
  }
  // Before memory is taken for an element: its records have a smallest size.
  void Require(const Element& element) {
    uint64_t bytes = 0;
    for (const auto& property : element.properties) {
      const Type fixed = property.list_count.value_or(property.type);
      bytes += format_ == Format::kAscii ? 2 : Bytes(fixed);
    }
    // The last ASCII value may end the file without a separator.
    const uint64_t slack = format_ == Format::kAscii && element.count > 0 ? 1 : 0;
    reader_.Require(element.count - slack, bytes, element.name + " records");
  }
  void Skip(const Property& property) {
    const double length = property.list_count ? Value(*property.list_count) : 1;
    if (!(length >= 0 && length < 1e9)) {
      throw InputError(reader_.Path(), "malformed list length");
    }
    for (double i = 0; i < length; ++i) Value(property.type);
  }

 private:
  template <typename T>
  double Binary() {
    T value = reader_.Read<T>("value");
    if (format_ == Format::kBig) {
      char bytes[sizeof(T)];
      std::memcpy(bytes, &value, sizeof(T));
      std::reverse(bytes, bytes + sizeof(T));
      std::memcpy(&value, bytes, sizeof(T));
    }
    return static_cast<double>(value);
  }
  double TextValue() {
    const std::string_view word = cursor_.Word();
    double value = 0;
    const auto [end, code] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (code != std::errc() || end != word.data() + word.size()) {
      cursor_.Fail("not a number: " + std::string(word.substr(0, 40)));
    }
    return value;
  }

  Format format_;
  TextCursor cursor_;
  ByteReader reader_;
};

// Where a known property's value goes.
struct Record {
  double x = 0, y = 0, z = 0, nx = 0, ny = 0, nz = 0, red = 0, green = 0, blue = 0;
  double footprint = 0, confidence = 1, coverage = 1, source = 0, px = 0, py = 0;
};

struct Field {
  std::string_view name;
  double Record::*member;
  Type type;  // as written
};

constexpr Field kFields[] = {
    {"x", &Record::x, Type::kFloat},
    {"y", &Record::y, Type::kFloat},
    {"z", &Record::z, Type::kFloat},
    {"nx", &Record::nx, Type::kFloat},
    {"ny", &Record::ny, Type::kFloat},
    {"nz", &Record::nz, Type::kFloat},
    {"red", &Record::red, Type::kUint8},
    {"green", &Record::green, Type::kUint8},
    {"blue", &Record::blue, Type::kUint8},
    {"footprint", &Record::footprint, Type::kFloat},
    {"confidence", &Record::confidence, Type::kFloat},
    {"coverage", &Record::coverage, Type::kFloat},
    {"source", &Record::source, Type::kUint16},
    {"px", &Record::px, Type::kUint16},
    {"py", &Record::py, Type::kUint16},
};

SelectionPoint ToPoint(const Record& record, uint64_t idx, bool own, size_t num_sources,
                       const fs::path& path) {
  const auto fail = [&](const char* fault) {
    throw InputError(path, "point " + std::to_string(idx) + ": " + fault);
  };
  SelectionPoint point;
  point.position = Eigen::Vector3d(record.x, record.y, record.z).cast<float>();
  point.normal = Eigen::Vector3d(record.nx, record.ny, record.nz).cast<float>();
  if (!point.position.allFinite()) fail("position is NaN or infinite");
  if (!point.normal.allFinite()) fail("normal is NaN or infinite");
  // A normal that is unit to rounding keeps its bits: what was written comes back as it was.
  const float length = point.normal.norm();
  if (length > 0 && std::abs(length - 1) > 1e-6F) point.normal /= length;
  const auto byte = [](double v) { return static_cast<uint8_t>(std::clamp(v, 0.0, 255.0)); };
  point.color = {byte(record.red), byte(record.green), byte(record.blue)};
  point.footprint = static_cast<float>(record.footprint);
  if (!(point.footprint >= 0 && std::isfinite(point.footprint))) fail("bad footprint");
  point.confidence = static_cast<float>(record.confidence);
  point.coverage = static_cast<float>(record.coverage);
  if (!(record.confidence >= 0 && record.confidence <= 1)) fail("confidence is not in [0, 1]");
  if (!(record.coverage >= 0 && record.coverage <= 1)) fail("coverage is not in [0, 1]");
  if (!own) return point;
  const auto is_u16 = [](double v) { return v >= 0 && v <= 65535; };
  if (!is_u16(record.source) || record.source >= double(num_sources)) fail("names no source view");
  if (!is_u16(record.px) || !is_u16(record.py)) fail("bad source pixel");
  point.source = static_cast<uint16_t>(record.source);
  point.x = static_cast<uint16_t>(record.px);
  point.y = static_cast<uint16_t>(record.py);
  return point;
}

// Clouds of other tools name no footprint: the spacing of the points stands in for it.
void EstimateFootprints(SelectionCloud& cloud) {
  std::vector<Eigen::Vector3f> positions;
  for (const auto& point : cloud.points) positions.push_back(point.position);
  const PointTree tree(positions);
  for (size_t i = 0; i < cloud.points.size(); ++i) {
    cloud.points[i].footprint = tree.Spacing(static_cast<int>(i), 4);
  }
}

void ReadVertices(const Element& element, const Header& header, Body& body, const fs::path& path,
                  SelectionCloud* cloud) {
  std::vector<double Record::*> members;  // null: skipped
  bool has[3] = {false, false, false};
  bool has_footprint = false, has_source = false, has_pixel = false;
  for (const auto& property : element.properties) {
    double Record::*member = nullptr;
    for (const auto& field : kFields) {
      if (field.name == property.name && !property.list_count) member = field.member;
    }
    members.push_back(member);
    has[0] |= member == &Record::x;
    has[1] |= member == &Record::y;
    has[2] |= member == &Record::z;
    has_footprint |= member == &Record::footprint;
    has_source |= member == &Record::source;
    has_pixel |= member == &Record::px;
  }
  if (!has[0] || !has[1] || !has[2]) throw InputError(path, "vertices lack x, y or z");
  const bool own = has_source && has_pixel && !header.sources.empty();
  if (own) cloud->sources = header.sources;
  body.Require(element);
  cloud->points.reserve(element.count);
  for (uint64_t i = 0; i < element.count; ++i) {
    Record record;
    for (size_t p = 0; p < members.size(); ++p) {
      if (members[p]) {
        record.*members[p] = body.Value(element.properties[p].type);
      } else {
        body.Skip(element.properties[p]);
      }
    }
    cloud->points.push_back(ToPoint(record, i, own, cloud->sources.size(), path));
  }
  if (!has_footprint) EstimateFootprints(*cloud);
}

template <typename T>
void PutValue(AtomicFile& file, double value) {
  file.WriteValue(static_cast<T>(value));
}

}  // namespace

void WriteCloud(const std::filesystem::path& path, const SelectionCloud& cloud) {
  static_assert(std::endian::native == std::endian::little);
  std::string header = "ply\nformat binary_little_endian 1.0\ncomment Retint selection cloud\n";
  for (const auto& name : cloud.sources) header += "comment source " + EscapeName(name) + "\n";
  header += "element vertex " + std::to_string(cloud.points.size()) + "\n";
  for (const auto& field : kFields) {
    const char* type = field.type == Type::kFloat   ? "float "
                       : field.type == Type::kUint8 ? "uchar "
                                                    : "ushort ";
    header += "property " + std::string(type) + std::string(field.name) + "\n";
  }
  AtomicFile file(path);
  file.Write(header + "end_header\n");
  for (const auto& point : cloud.points) {
    const Record record{point.position.x(),     point.position.y(),     point.position.z(),
                        point.normal.x(),       point.normal.y(),       point.normal.z(),
                        double(point.color[0]), double(point.color[1]), double(point.color[2]),
                        point.footprint,        point.confidence,       point.coverage,
                        double(point.source),   double(point.x),        double(point.y)};
    for (const auto& field : kFields) {
      const double value = record.*field.member;
      if (field.type == Type::kFloat) {
        PutValue<float>(file, value);
      } else if (field.type == Type::kUint8) {
        PutValue<uint8_t>(file, value);
      } else {
        PutValue<uint16_t>(file, value);
      }
    }
  }
  file.Commit();
}

SelectionCloud ReadCloud(const std::filesystem::path& path) {
  const std::string bytes = ReadFile(path);
  TextCursor cursor(bytes, path);
  const Header header = ParseHeader(cursor);
  Body body(bytes, path, header.format, cursor);
  SelectionCloud cloud;
  for (const auto& element : header.elements) {
    if (element.name == "vertex") {
      ReadVertices(element, header, body, path, &cloud);
      return cloud;
    }
    if (element.properties.empty()) continue;
    body.Require(element);
    for (uint64_t i = 0; i < element.count; ++i) {
      for (const auto& property : element.properties) body.Skip(property);
    }
  }
  throw InputError(path, "holds no vertices");
}

}  // namespace retint
