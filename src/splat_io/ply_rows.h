// SPDX-License-Identifier: BSD-3-Clause
// Internal to splat_io: how a 3DGS .ply lays out its rows, and rows as Gaussians.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "base/input_file.h"
#include "base/ply_header.h"
#include "scene/gaussian_model.h"
#include "splat_io/splat_io.h"

namespace retint {

// One array of the model and the column of each of its values, in the array's order.
struct PlyField {
  FloatArray GaussianModel::*values;
  std::vector<std::string> columns;
};

// The whole mapping between file and model, for reading and writing alike. The degree is the
// file's, up to 4, whose own coefficients are columns that are carried (scene/sh_band4.h).
std::vector<PlyField> PlyFields(int sh_degree);

// f_rest_0 and so on.
bool IsPlyRest(std::string_view column);

struct PlyLayout {
  PlyHeader header;  // binary little-endian or ascii, "vertex" first
  int degree = 0;    // the file's, 0 to 4
  std::vector<PlyField> fields;
  std::unordered_map<std::string, size_t> offsets;  // of a column in a binary row, bytes
  size_t stride = 0;                                // of a binary row, bytes
  SourceLayout source;                              // without data
  bool is_flat = false;                             // 2D Gaussians, which have no scale_2
  uint64_t count() const { return header.elements[0].count; }
};

// InputError for a file that is no 3DGS .ply, or whose length does not fit its header.
PlyLayout ReadPlyLayout(const InputFile& file);

// A note of bytes after all that the header of a PLY announces.
std::string BytesLeftOut(const std::filesystem::path& path, uint64_t bytes, uint64_t gaussians);

class PlyRowReader {
 public:
  // Fills `model`, which has the size and the source of `layout`; all must outlive the reader.
  // Takes the render model and the color space from the header, and notes what they cost.
  PlyRowReader(const PlyLayout& layout, GaussianModel& model, const std::filesystem::path& path,
               BadRows bad);

  // `count` binary rows, which lie at `rows`, as the model's Gaussians from `first` on. A value
  // that is not finite is an InputError with the row's number in the file: numbers[i], or without
  // them first + i.
  void Take(const char* rows, size_t first, size_t count, const uint32_t* numbers = nullptr);

 private:
  struct Gather {                 // a field's columns
    std::vector<size_t> offsets;  // bytes in a row; SIZE_MAX: a scale that the file lacks
    std::vector<bool> is_double;
    bool any_double = false;
  };

  void TakeDoubles(const Gather& gather, const char* rows, size_t count, float* to) const;

  const std::vector<PlyField>& fields_;
  std::vector<Gather> gathers_;
  std::vector<size_t> extra_offsets_;
  size_t stride_;
  GaussianModel& model_;
  const std::filesystem::path& path_;
  BadRows bad_;
};

}  // namespace retint
