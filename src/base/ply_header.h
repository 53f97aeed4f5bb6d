// SPDX-License-Identifier: BSD-3-Clause
// The text header of a PLY file (Turk, "The PLY Polygon File Format", 1994). Lines may end in LF or
// CRLF.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace retint {

struct PlyProperty {
  std::string name;
  std::string type;  // as spelled: "float", "float32", "uchar", ...; "list ..." for a list
  int bytes = 0;     // of one value; 0 for a list
  int64_t line = 0;  // of the header, from 1
  std::string ToLine() const { return "property " + type + " " + name; }
};

struct PlyElement {
  std::string name;
  uint64_t count = 0;
  std::vector<PlyProperty> properties;
  int64_t line = 0;
  std::string ToLine() const { return "element " + name + " " + std::to_string(count); }
};

struct PlyHeader {
  std::string format;                 // "binary_little_endian", "ascii", ...
  std::vector<std::string> comments;  // "comment ..." and "obj_info ..." lines, whole
  std::vector<PlyElement> elements;
  uint64_t bytes = 0;  // length; the data starts here
  int64_t lines = 0;
};

inline constexpr uint64_t kMaxPlyHeaderBytes = uint64_t{1} << 20;

// `head`: the start of the file, up to kMaxPlyHeaderBytes. InputError with `path` and line for
// anything that is not a well-formed header.
PlyHeader ParsePlyHeader(std::string_view head, const std::filesystem::path& path);

// Bytes of a scalar type, by either of its names; 0 for an unknown one.
int PlyTypeBytes(std::string_view type);

}  // namespace retint
