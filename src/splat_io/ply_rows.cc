// SPDX-License-Identifier: BSD-3-Clause
#include "splat_io/ply_rows.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <unordered_set>

#include "base/error.h"
#include "base/option_name.h"
#include "splat_io/splat_row.h"
#include "splat_io/splat_tags.h"

namespace retint {
namespace {

static_assert(std::endian::native == std::endian::little);

using ColumnOffsets = std::unordered_map<std::string, size_t>;

constexpr const char* kThickness = "scale_2";  // of a Gaussian; the discs of 2DGS have none

std::string Indexed(std::string_view prefix, int i) {
  return std::string(prefix) + std::to_string(i);
}

bool IsDouble(std::string_view type) { return type == "double" || type == "float64"; }
bool IsFloating(std::string_view type) {
  return type == "float" || type == "float32" || IsDouble(type);
}

void RefuseOtherKinds(const PlyHeader& header, const std::filesystem::path& path) {
  if (header.format != "binary_little_endian" && header.format != "ascii") {
    throw InputError(path, "this is a PLY of format " + header.format.substr(0, 40) +
                               ", not supported; supported: binary_little_endian and ascii");
  }
  if (header.elements.empty() || header.elements[0].name != "vertex") {
    throw InputError(path, header.elements.empty()
                               ? std::string("PLY header has no element vertex")
                               : "PLY element " + header.elements[0].name +
                                     " stands before or instead of element vertex");
  }
}

int InferDegree(const PlyElement& vertex, const std::filesystem::path& path) {
  const auto rest = std::count_if(vertex.properties.begin(), vertex.properties.end(),
                                  [](const PlyProperty& p) { return IsPlyRest(p.name); });
  for (int degree = 0; degree <= 4; ++degree) {
    if (rest == 3 * ((degree + 1) * (degree + 1) - 1)) return degree;
  }
  throw InputError(path, std::to_string(rest) +
                             " f_rest_* columns; 0, 9, 24, 45 or 72 make an SH degree of 0 to 4");
}

// True if only the thickness of 2D Gaussians is missing. InputError if another column is missing.
bool RequireColumns(const PlyLayout& layout, const std::filesystem::path& path) {
  std::string missing;
  int count = 0;
  for (const PlyField& field : layout.fields) {
    for (const std::string& column : field.columns) {
      if (layout.offsets.contains(column)) continue;
      if (++count <= 8) missing += (count > 1 ? ", " : "") + column;
    }
  }
  const bool is_flat = missing == kThickness;
  if (count == 0 || is_flat) return is_flat;
  throw InputError(path, "not a 3DGS .ply: vertex lacks " + missing +
                             (count > 8 ? ", ... (" + std::to_string(count) + " in all)" : ""));
}

// Lays out the columns of a row and lists the kept ones in `source`. Returns the bytes of a row.
size_t LayOutRow(const PlyElement& vertex, const std::vector<PlyField>& fields,
                 const std::filesystem::path& path, ColumnOffsets& offsets, SourceLayout& source) {
  std::unordered_set<std::string_view> known;
  for (const PlyField& field : fields) known.insert(field.columns.begin(), field.columns.end());
  size_t stride = 0;
  for (const PlyProperty& property : vertex.properties) {
    if (property.bytes == 0) {
      throw InputError(path, property.line,
                       "list property " + property.name + " in element vertex is not supported");
    }
    const bool is_known = known.contains(property.name);
    if (is_known && !IsFloating(property.type)) {
      throw InputError(
          path, property.line,
          "property " + property.name + " is " + property.type + ", expected float or double");
    }
    if (!is_known) source.extras.push_back({property.name, property.type, property.bytes, {}});
    source.property_order.push_back(property.name);
    offsets.emplace(property.name, stride);
    stride += static_cast<size_t>(property.bytes);
  }
  return stride;
}

// Checks the file's length against that of its rows: `stride` each in binary, at least 2 a value in
// ascii. Notes bytes after the rows, which other programs ignore.
void CheckLength(const PlyHeader& header, size_t stride, uint64_t file_bytes,
                 const std::filesystem::path& path, SourceLayout& source) {
  const uint64_t count = header.elements[0].count;
  const uint64_t body = file_bytes - header.bytes;
  if (count == 0) throw InputError(path, "holds no Gaussians");
  if (header.format == "ascii") {
    stride = 2 * header.elements[0].properties.size();  // a digit and a separator
    if (count > (body + 1) / stride) {
      throw InputError(path, "truncated: the header announces " + std::to_string(count) +
                                 " Gaussians, " + std::to_string(body) + " bytes follow it");
    }
    return;
  }
  if (count > body / stride) {
    throw InputError(path, "truncated: the header announces " + std::to_string(count) +
                               " Gaussians of " + std::to_string(stride) + " bytes, " +
                               std::to_string(body) + " bytes follow it");
  }
  if (header.elements.size() == 1 && body > count * stride) {
    source.notes.push_back(BytesLeftOut(path, body - count * stride, count));
  }
}

// Whether a value is NaN or infinite: all exponent bits are 1. Branch-free, so that it vectorizes.
bool AnyNotFinite(const float* values, size_t count) {
  uint32_t any = 0;
  for (size_t i = 0; i < count; ++i) {
    any |= (std::bit_cast<uint32_t>(values[i]) & 0x7f800000u) == 0x7f800000u ? 1u : 0u;
  }
  return any != 0;
}

// Converters from formats with 8-bit opacities write infinite logits for 0 and 1 (Niantic's spz
// does). They are read as in those formats.
void KeepLogitsFinite(float* logits, size_t count) {
  for (size_t i = 0; i < count; ++i) {
    if (std::isinf(logits[i])) logits[i] = Logit(logits[i] > 0 ? 1 : 0);
  }
}

[[noreturn]] void FailNotFinite(const PlyField& field, const float* rows, size_t first_row,
                                const uint32_t* numbers, const std::filesystem::path& path) {
  size_t i = 0;
  while (std::isfinite(rows[i])) ++i;
  const size_t width = field.columns.size();
  const size_t row = numbers ? numbers[i / width] : first_row + i / width;
  throw InputError(path, "Gaussian " + std::to_string(row) + ": " + field.columns[i % width] +
                             (std::isnan(rows[i]) ? " is NaN" : " is infinite") +
                             "; `retint convert` with " + OptionName("drop_bad") +
                             " writes a file without such rows");
}

}  // namespace

std::vector<PlyField> PlyFields(int sh_degree) {
  const int num_coeffs = (sh_degree + 1) * (sh_degree + 1);
  std::vector<std::string> sh = {"f_dc_0", "f_dc_1", "f_dc_2"};
  for (int k = 1; k < std::min(num_coeffs, 16); ++k) {
    for (int c = 0; c < 3; ++c) sh.push_back(Indexed("f_rest_", c * (num_coeffs - 1) + k - 1));
  }
  return {{&GaussianModel::means, {"x", "y", "z"}},
          {&GaussianModel::quats_wxyz, {"rot_0", "rot_1", "rot_2", "rot_3"}},
          {&GaussianModel::log_scales, {"scale_0", "scale_1", "scale_2"}},
          {&GaussianModel::opacity_logits, {"opacity"}},
          {&GaussianModel::sh, std::move(sh)}};
}

bool IsPlyRest(std::string_view column) {
  return column.starts_with("f_rest_") && column.size() > 7 &&
         column.find_first_not_of("0123456789", 7) == std::string_view::npos;
}

PlyLayout ReadPlyLayout(const InputFile& file) {
  const std::filesystem::path& path = file.path();
  std::string head(std::min(file.size(), kMaxPlyHeaderBytes), '\0');
  file.ReadAt(0, head.data(), head.size());
  PlyLayout layout;
  layout.header = ParsePlyHeader(head, path);
  RefuseOtherKinds(layout.header, path);
  const PlyElement& vertex = layout.header.elements[0];
  layout.source.comments = layout.header.comments;
  layout.degree = InferDegree(vertex, path);
  layout.fields = PlyFields(layout.degree);
  layout.stride = LayOutRow(vertex, layout.fields, path, layout.offsets, layout.source);
  layout.is_flat = RequireColumns(layout, path);
  CheckLength(layout.header, layout.stride, file.size(), path, layout.source);
  return layout;
}

std::string BytesLeftOut(const std::filesystem::path& path, uint64_t bytes, uint64_t gaussians) {
  return path.string() + ": " + std::to_string(bytes) + " bytes after the last of " +
         std::to_string(gaussians) + " Gaussians are ignored";
}

PlyRowReader::PlyRowReader(const PlyLayout& layout, GaussianModel& model,
                           const std::filesystem::path& path, BadRows bad)
    : fields_(layout.fields), stride_(layout.stride), model_(model), path_(path), bad_(bad) {
  std::unordered_set<std::string_view> doubles;
  for (const PlyProperty& property : layout.header.elements[0].properties) {
    if (IsDouble(property.type)) doubles.insert(property.name);
  }
  for (const PlyField& field : fields_) {
    Gather& gather = gathers_.emplace_back();
    for (const std::string& column : field.columns) {
      const bool lacks = layout.is_flat && column == kThickness;
      gather.offsets.push_back(lacks ? SIZE_MAX : layout.offsets.at(column));
      gather.is_double.push_back(doubles.contains(column));
      gather.any_double |= doubles.contains(column);
    }
  }
  ReadTags(model);
  if (layout.is_flat) {
    model.traits.render_model = RenderModel::k2dgs;
    model.traits.render_model_reason = "two scales a Gaussian";
  }
  NoteRenderModel(model);
  for (ExtraColumn& extra : model.source.extras) {
    extra.bytes.resize(model.NumGaussians() * static_cast<size_t>(extra.bytes_per_value));
    extra_offsets_.push_back(layout.offsets.at(extra.name));
  }
}

void PlyRowReader::Take(const char* rows, size_t first, size_t count, const uint32_t* numbers) {
  for (size_t f = 0; f < fields_.size(); ++f) {
    const Gather& gather = gathers_[f];
    const size_t width = gather.offsets.size();
    float* to = (model_.*fields_[f].values).data() + first * width;
    for (size_t r = 0; r < count; ++r) {
      const char* row = rows + r * stride_;
      for (size_t j = 0; j < width; ++j) {
        if (gather.offsets[j] == SIZE_MAX) {
          to[r * width + j] = LogScale(0);
        } else {
          std::memcpy(to + r * width + j, row + gather.offsets[j], 4);
        }
      }
    }
    if (gather.any_double) TakeDoubles(gather, rows, count, to);
    if (fields_[f].values == &GaussianModel::opacity_logits) KeepLogitsFinite(to, count);
    if (bad_ == BadRows::kDrop) continue;
    if (AnyNotFinite(to, count * width)) FailNotFinite(fields_[f], to, first, numbers, path_);
  }
  for (size_t e = 0; e < extra_offsets_.size(); ++e) {
    ExtraColumn& extra = model_.source.extras[e];
    const auto width = static_cast<size_t>(extra.bytes_per_value);
    const char* from = rows + extra_offsets_[e];
    char* to = extra.bytes.data() + first * width;
    for (size_t r = 0; r < count; ++r) std::memcpy(to + r * width, from + r * stride_, width);
  }
}

// A double beyond the range of float becomes infinite, and is then rejected.
void PlyRowReader::TakeDoubles(const Gather& gather, const char* rows, size_t count,
                               float* to) const {
  const size_t width = gather.offsets.size();
  for (size_t j = 0; j < width; ++j) {
    if (!gather.is_double[j]) continue;
    for (size_t r = 0; r < count; ++r) {
      double value;
      std::memcpy(&value, rows + r * stride_ + gather.offsets[j], sizeof(value));
      to[r * width + j] = static_cast<float>(value);
    }
  }
}

}  // namespace retint
