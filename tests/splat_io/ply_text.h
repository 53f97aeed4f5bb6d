// SPDX-License-Identifier: BSD-3-Clause
// A 3DGS .ply put together column by column, apart from the codec that it tests.
#pragma once

#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include "base/error.h"
#include "base/files.h"
#include "scene/gaussian_model.h"
#include "tests/support/data.h"

namespace retint {

struct PlyText {
  struct Column {
    std::string type, name;
    std::vector<std::string> values;  // [N] raw bytes
  };
  std::string format = "binary_little_endian";
  std::vector<std::string> comments;
  size_t count = 0;
  std::vector<Column> columns;
  std::vector<std::string> trailing_header;
  std::string trailing_bytes;
  std::string line_end = "\n";

  template <typename T>
  static std::string Raw(T value) {
    return std::string(reinterpret_cast<const char*>(&value), sizeof(T));
  }

  // Every value differs from every other: 1000 * column + row, which floats hold exactly.
  static float Value(size_t column, size_t row) {
    return static_cast<float>(1000 * column + row) / 4096.0f;
  }

  // The original code's columns at an SH degree.
  static PlyText Canonical(size_t count, int degree) {
    PlyText ply;
    ply.count = count;
    std::vector<std::string> names = {"x", "y", "z", "nx", "ny", "nz"};
    for (int i = 0; i < 3; ++i) names.push_back("f_dc_" + std::to_string(i));
    const int rest[] = {0, 9, 24, 45};
    for (int i = 0; i < rest[degree]; ++i) names.push_back("f_rest_" + std::to_string(i));
    names.push_back("opacity");
    for (int i = 0; i < 3; ++i) names.push_back("scale_" + std::to_string(i));
    for (int i = 0; i < 4; ++i) names.push_back("rot_" + std::to_string(i));
    for (size_t c = 0; c < names.size(); ++c) {
      Column column{"float", names[c], {}};
      const bool normal = names[c][0] == 'n';
      for (size_t r = 0; r < count; ++r) column.values.push_back(Raw(normal ? 0.0f : Value(c, r)));
      ply.columns.push_back(std::move(column));
    }
    return ply;
  }

  Column& operator[](std::string_view name) {
    for (Column& column : columns) {
      if (column.name == name) return column;
    }
    throw std::out_of_range(std::string(name));
  }
  float Float(std::string_view name, size_t row) {
    float value;
    std::memcpy(&value, (*this)[name].values.at(row).data(), sizeof(value));
    return value;
  }
  void Remove(std::string_view name) {
    std::erase_if(columns, [&](const Column& column) { return column.name == name; });
  }

  std::string Header() const {
    std::vector<std::string> lines = {"ply", "format " + format + " 1.0"};
    lines.insert(lines.end(), comments.begin(), comments.end());
    lines.push_back("element vertex " + std::to_string(count));
    for (const Column& column : columns) {
      lines.push_back("property " + column.type + " " + column.name);
    }
    lines.insert(lines.end(), trailing_header.begin(), trailing_header.end());
    lines.push_back("end_header");
    std::string text;
    for (const std::string& line : lines) text += line + line_end;
    return text;
  }
  std::string Body() const {
    std::string bytes;
    for (size_t r = 0; r < count; ++r) {
      for (const Column& column : columns) bytes += column.values.at(r);
    }
    return bytes + trailing_bytes;
  }
  std::string Bytes() const { return Header() + Body(); }
};

// WriteFile without its fsync, which would be most of the time of many small files.
inline void SpillFile(const std::filesystem::path& path, std::string_view bytes) {
  std::ofstream(path, std::ios::binary).write(bytes.data(), std::streamsize(bytes.size()));
}

// The message of the `Exception` that `call` throws; a test failure and "" when it throws none.
template <typename Exception, typename Call>
std::string MessageOf(Call&& call) {
  try {
    call();
  } catch (const Exception& error) {
    return error.what();
  } catch (const std::exception& error) {
    ADD_FAILURE() << "another exception: " << error.what();
    return "";
  }
  ADD_FAILURE() << "no exception";
  return "";
}

}  // namespace retint
