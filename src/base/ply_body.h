// SPDX-License-Identifier: BSD-3-Clause
// The values of a PLY file that is in memory whole, one after the other, whatever its format: ascii
// or binary of either byte order.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string_view>

#include "base/files.h"
#include "base/ply_header.h"

namespace retint {

enum class PlyType { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat, kDouble };

// The announcement of a property line.
struct PlyColumn {
  PlyType type = PlyType::kFloat;
  std::optional<PlyType> list_count;  // of a list: the type of its length
};
PlyColumn ColumnOf(const PlyProperty& property);

class PlyBody {
 public:
  // `file` is the whole file, of which `header` was read. InputError for an unknown format.
  PlyBody(std::string_view file, const PlyHeader& header, const std::filesystem::path& path);

  // The next value. InputError where the file ends or, in ascii, for text that is no number (with
  // its line).
  double Value(PlyType type);
  // The next property, a list or not. InputError for a length that no list has.
  void Skip(const PlyColumn& column);
  void Skip(const PlyElement& element);  // all of its rows
  // Before memory is taken for an element: InputError where its rows do not fit into the file.
  void Require(const PlyElement& element) const;

 private:
  enum class Format { kAscii, kLittle, kBig };
  template <typename T>
  double Binary();
  double TextValue();
  std::string_view Word();

  Format format_ = Format::kAscii;
  std::string_view text_;  // ascii: the rest
  int64_t line_ = 0;
  ByteReader reader_;
};

}  // namespace retint
