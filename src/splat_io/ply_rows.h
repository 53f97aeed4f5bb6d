// SPDX-License-Identifier: BSD-3-Clause
// Internal to splat_io: the layout of rows in a 3DGS .ply, and their conversion to Gaussians.
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

// An array of the model, and the column of each of its values, in order.
struct PlyField {
  FloatArray GaussianModel::*values;
  std::vector<std::string> columns;
};

// The mapping between file and model, for reading and writing. The degree is the file's, up to 4;
// own columns keep the coefficients of degree 4 (scene/sh_band4.h).
std::vector<PlyField> PlyFields(int sh_degree);

// Whether a column is f_rest_0, f_rest_1, ...
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

// InputError for a file that is not a 3DGS .ply, or has another length than its header says.
PlyLayout ReadPlyLayout(const InputFile& file);

// The note about bytes after those that a PLY's header announces.
std::string BytesLeftOut(const std::filesystem::path& path, uint64_t bytes, uint64_t gaussians);

class PlyRowReader {
 public:
  // Fills `model`, which has the size and the source of `layout`. All arguments must outlive the
  // reader. Reads render model and color space from the header, and notes their effects.
  PlyRowReader(const PlyLayout& layout, GaussianModel& model, const std::filesystem::path& path,
               BadRows bad);

  // Converts `count` binary rows at `rows` to the Gaussians from `first` on. InputError for a value
  // that is not finite, with the row's number in the file: numbers[i], or first + i if `numbers` is
  // null.
  void Take(const char* rows, size_t first, size_t count, const uint32_t* numbers = nullptr);

 private:
  struct Gather {                 // the columns of a field
    std::vector<size_t> offsets;  // in bytes; SIZE_MAX: a scale that the file lacks
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
