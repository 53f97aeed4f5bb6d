// SPDX-License-Identifier: BSD-3-Clause
#include "splat_io/ply_codec.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <unordered_map>
#include <unordered_set>

#include "base/error.h"
#include "base/files.h"
#include "base/ply_header.h"
#include "scene/sh_band4.h"
#include "splat_io/input_file.h"
#include "splat_io/ply_ascii.h"
#include "splat_io/splat_row.h"

namespace retint {
namespace {

static_assert(std::endian::native == std::endian::little);

constexpr size_t kBlockBytes = size_t{256} << 10;  // of rows at a time; stays in the L2 cache

std::string Indexed(std::string_view prefix, int i) {
  return std::string(prefix) + std::to_string(i);
}

// One array of the model and the column of each of its values, in the array's order.
struct Field {
  std::vector<float> GaussianModel::*values;
  std::vector<std::string> columns;
};

// The whole mapping between file and model, for reading and writing alike. The degree is the
// file's, up to 4, whose own coefficients are columns that are carried (scene/sh_band4.h).
std::vector<Field> Fields(int sh_degree) {
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

int FileDegree(const GaussianModel& model) { return HasShBand4(model) ? 4 : model.sh_degree; }

// The columns in the order of the original code.
std::vector<std::string> CanonicalOrder(int sh_degree) {
  std::vector<std::string> order = {"x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2"};
  const int rest = 3 * ((sh_degree + 1) * (sh_degree + 1) - 1);
  for (int i = 0; i < rest; ++i) order.push_back(Indexed("f_rest_", i));
  order.push_back("opacity");
  for (int i = 0; i < 3; ++i) order.push_back(Indexed("scale_", i));
  for (int i = 0; i < 4; ++i) order.push_back(Indexed("rot_", i));
  return order;
}

bool IsRest(std::string_view column) {
  return column.starts_with("f_rest_") && column.size() > 7 &&
         column.find_first_not_of("0123456789", 7) == std::string_view::npos;
}

// ---- Reading

using ColumnOffsets = std::unordered_map<std::string, size_t>;  // byte offset in a row

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
                                  [](const PlyProperty& p) { return IsRest(p.name); });
  for (int degree = 0; degree <= 4; ++degree) {
    if (rest == 3 * ((degree + 1) * (degree + 1) - 1)) return degree;
  }
  throw InputError(path, std::to_string(rest) +
                             " f_rest_* columns; 0, 9, 24, 45 or 72 make an SH degree of 0 to 4");
}

void RequireColumns(const std::vector<Field>& fields, const ColumnOffsets& offsets,
                    const std::filesystem::path& path) {
  std::string missing;
  int count = 0;
  for (const Field& field : fields) {
    for (const std::string& column : field.columns) {
      if (offsets.contains(column)) continue;
      if (++count <= 8) missing += (count > 1 ? ", " : "") + column;
    }
  }
  if (count == 0) return;
  throw InputError(path, "not a 3DGS .ply: vertex lacks " + missing +
                             (count > 8 ? ", ... (" + std::to_string(count) + " in all)" : ""));
}

// Lays out the columns of a row, notes what is carried in `source`; returns the bytes of a row.
size_t LayOutRow(const PlyElement& vertex, const std::vector<Field>& fields,
                 const std::filesystem::path& path, ColumnOffsets& offsets, SourceLayout& source) {
  std::unordered_set<std::string_view> known;
  for (const Field& field : fields) known.insert(field.columns.begin(), field.columns.end());
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

// The least and, in binary, the only length of a row, `stride`, against the file's.
void CheckLength(const PlyHeader& header, size_t stride, uint64_t file_bytes,
                 const std::filesystem::path& path) {
  const uint64_t count = header.elements[0].count;
  const uint64_t body = file_bytes - header.bytes;
  if (count == 0) throw InputError(path, "holds no Gaussians");
  if (header.format == "ascii") {
    stride = 2 * header.elements[0].properties.size();  // a digit and what ends it
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
    throw InputError(path, std::to_string(body - count * stride) + " bytes follow the last of " +
                               std::to_string(count) + " Gaussians: the file is damaged");
  }
}

// True when a value is NaN or infinite: all exponent bits set. Branch-free, so that it vectorises.
bool AnyNotFinite(const float* values, size_t count) {
  uint32_t any = 0;
  for (size_t i = 0; i < count; ++i) {
    any |= (std::bit_cast<uint32_t>(values[i]) & 0x7f800000u) == 0x7f800000u ? 1u : 0u;
  }
  return any != 0;
}

[[noreturn]] void FailNotFinite(const Field& field, const float* rows, size_t first_row,
                                const std::filesystem::path& path) {
  size_t i = 0;
  while (std::isfinite(rows[i])) ++i;
  const size_t width = field.columns.size();
  throw InputError(path, "Gaussian " + std::to_string(first_row + i / width) + ": " +
                             field.columns[i % width] +
                             (std::isnan(rows[i]) ? " is NaN" : " is infinite") +
                             "; `retint convert --drop-bad` writes a file without such rows");
}

class RowReader {
 public:
  RowReader(const PlyElement& vertex, const std::vector<Field>& fields,
            const ColumnOffsets& offsets, size_t stride, GaussianModel& model,
            const std::filesystem::path& path, BadRows bad)
      : fields_(fields), stride_(stride), model_(model), path_(path), bad_(bad) {
    std::unordered_set<std::string_view> doubles;
    for (const PlyProperty& property : vertex.properties) {
      if (IsDouble(property.type)) doubles.insert(property.name);
    }
    for (const Field& field : fields) {
      Gather& gather = gathers_.emplace_back();
      for (const std::string& column : field.columns) {
        gather.offsets.push_back(offsets.at(column));
        gather.is_double.push_back(doubles.contains(column));
        gather.any_double |= doubles.contains(column);
      }
    }
    for (ExtraColumn& extra : model.source.extras) {
      extra.bytes.resize(model.NumGaussians() * static_cast<size_t>(extra.bytes_per_value));
      extra_offsets_.push_back(offsets.at(extra.name));
    }
  }

  // Rows [first, first + count) of the file, which lie at `rows`.
  void Take(const char* rows, size_t first, size_t count) {
    for (size_t f = 0; f < fields_.size(); ++f) {
      const Gather& gather = gathers_[f];
      const size_t width = gather.offsets.size();
      float* to = (model_.*fields_[f].values).data() + first * width;
      for (size_t r = 0; r < count; ++r) {
        const char* row = rows + r * stride_;
        for (size_t j = 0; j < width; ++j) {
          std::memcpy(to + r * width + j, row + gather.offsets[j], 4);
        }
      }
      if (gather.any_double) TakeDoubles(gather, rows, count, to);
      if (bad_ == BadRows::kDrop) continue;
      if (AnyNotFinite(to, count * width)) FailNotFinite(fields_[f], to, first, path_);
    }
    for (size_t e = 0; e < extra_offsets_.size(); ++e) {
      ExtraColumn& extra = model_.source.extras[e];
      const auto width = static_cast<size_t>(extra.bytes_per_value);
      const char* from = rows + extra_offsets_[e];
      char* to = extra.bytes.data() + first * width;
      for (size_t r = 0; r < count; ++r) std::memcpy(to + r * width, from + r * stride_, width);
    }
  }

 private:
  struct Gather {                 // a field's columns
    std::vector<size_t> offsets;  // bytes in a row
    std::vector<bool> is_double;
    bool any_double = false;
  };

  // A double beyond the range of float becomes infinite and is refused as such.
  void TakeDoubles(const Gather& gather, const char* rows, size_t count, float* to) const {
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

  const std::vector<Field>& fields_;
  std::vector<Gather> gathers_;
  std::vector<size_t> extra_offsets_;
  size_t stride_;
  GaussianModel& model_;
  const std::filesystem::path& path_;
  BadRows bad_;
};

void KeepTrailingHeader(const PlyHeader& header, SourceLayout& source) {
  for (size_t e = 1; e < header.elements.size(); ++e) {
    source.trailing_header.push_back(header.elements[e].ToLine());
    for (const PlyProperty& property : header.elements[e].properties) {
      source.trailing_header.push_back(property.ToLine());
    }
  }
}

// Reads the rows block by block, from binary as they are or from ascii as if it had been binary.
void ReadBody(const PlyHeader& header, const InputFile& file, size_t stride, RowReader& reader,
              Monitor& monitor, std::vector<char>& trailing) {
  const size_t count = header.elements[0].count;
  const size_t rows_a_block = std::max<size_t>(1, kBlockBytes / stride);
  std::vector<char> block(std::min(rows_a_block, count) * stride);
  PlyAscii ascii(file, header);
  const bool is_ascii = header.format == "ascii";
  for (size_t first = 0; first < count; first += rows_a_block) {
    monitor.Step("load", static_cast<double>(first), static_cast<double>(count));
    const size_t rows = std::min(rows_a_block, count - first);
    if (is_ascii) {
      ascii.ReadRows(header.elements[0], first, rows, block);
    } else {
      file.ReadAt(header.bytes + first * stride, block.data(), rows * stride);
    }
    reader.Take(block.data(), first, rows);
  }
  if (is_ascii) {
    for (size_t e = 1; e < header.elements.size(); ++e) {
      ascii.ReadElement(header.elements[e], trailing);
    }
    ascii.ExpectEnd();
  } else if (header.elements.size() > 1) {
    const uint64_t offset = header.bytes + count * stride;
    trailing.resize(file.size() - offset);
    file.ReadAt(offset, trailing.data(), trailing.size());
  }
}

// ---- Writing

[[noreturn]] void FailWrite(const std::filesystem::path& path, const std::string& fault) {
  throw RunError(path.string() + ": not written: " + fault);
}

void CheckWritable(const GaussianModel& model, const std::filesystem::path& path) {
  ValidateWrite(model, path);
  for (const ExtraColumn& extra : model.source.extras) {
    if (PlyTypeBytes(extra.type) != extra.bytes_per_value ||
        extra.bytes.size() != model.NumGaussians() * static_cast<size_t>(extra.bytes_per_value)) {
      FailWrite(path, "column " + extra.name + " does not match the number of Gaussians");
    }
  }
}

// The source's columns, where they fit the model: columns that the model no longer has are dropped,
// missing ones follow the last SH column.
std::vector<std::string> ColumnOrder(const GaussianModel& model, const std::vector<Field>& fields) {
  const std::vector<std::string> canonical = CanonicalOrder(FileDegree(model));
  if (model.source.property_order.empty()) return canonical;
  std::unordered_set<std::string_view> wanted;
  for (const Field& field : fields) wanted.insert(field.columns.begin(), field.columns.end());
  std::unordered_set<std::string_view> available = wanted;
  for (const ExtraColumn& extra : model.source.extras) available.insert(extra.name);
  std::vector<std::string> order;
  size_t after_sh = 0;
  for (const std::string& column : model.source.property_order) {
    if (!available.erase(column)) continue;
    order.push_back(column);
    if (IsRest(column) || column == "f_dc_2") after_sh = order.size();
  }
  std::vector<std::string> missing;
  for (const std::string& column : canonical) {
    if (wanted.contains(column) && available.contains(column)) missing.push_back(column);
  }
  order.insert(order.begin() + static_cast<std::ptrdiff_t>(after_sh), missing.begin(),
               missing.end());
  return order;
}

std::string HeaderText(const GaussianModel& model, const std::vector<std::string>& order) {
  std::unordered_map<std::string_view, std::string_view> types;
  for (const ExtraColumn& extra : model.source.extras) types[extra.name] = extra.type;
  std::string text = "ply\nformat binary_little_endian 1.0\n";
  for (const std::string& comment : model.source.comments) text += comment + "\n";
  text += "element vertex " + std::to_string(model.NumGaussians()) + "\n";
  for (const std::string& column : order) {
    const auto found = types.find(column);
    text += "property " + std::string(found == types.end() ? "float" : found->second) + " " +
            column + "\n";
  }
  for (const std::string& line : model.source.trailing_header) text += line + "\n";
  return text + "end_header\n";
}

class RowWriter {
 public:
  RowWriter(const GaussianModel& model, const std::vector<Field>& fields,
            const std::vector<std::string>& order)
      : model_(model), fields_(fields) {
    std::unordered_map<std::string_view, size_t> widths;
    for (const ExtraColumn& extra : model.source.extras) {
      widths[extra.name] = static_cast<size_t>(extra.bytes_per_value);
    }
    ColumnOffsets offsets;
    for (const std::string& column : order) {
      offsets[column] = stride_;
      const auto found = widths.find(column);
      stride_ += found == widths.end() ? sizeof(float) : found->second;
    }
    for (const Field& field : fields) {
      std::vector<size_t>& scatter = scatters_.emplace_back();
      for (const std::string& column : field.columns) scatter.push_back(offsets.at(column));
    }
    for (const ExtraColumn& extra : model.source.extras) {
      const auto found = offsets.find(extra.name);
      if (found != offsets.end()) extras_.emplace_back(&extra, found->second);
    }
  }

  size_t stride() const { return stride_; }

  // Rows [first, first + count) into `rows`. Columns without a source (nx ny nz) stay as they are.
  void Give(char* rows, size_t first, size_t count) const {
    for (size_t f = 0; f < fields_.size(); ++f) {
      const std::vector<size_t>& scatter = scatters_[f];
      const size_t width = scatter.size();
      const float* from = (model_.*fields_[f].values).data() + first * width;
      for (size_t r = 0; r < count; ++r) {
        char* row = rows + r * stride_;
        for (size_t j = 0; j < width; ++j) std::memcpy(row + scatter[j], from + r * width + j, 4);
      }
    }
    for (const auto& [extra, offset] : extras_) {
      const auto width = static_cast<size_t>(extra->bytes_per_value);
      const char* from = extra->bytes.data() + first * width;
      char* to = rows + offset;
      for (size_t r = 0; r < count; ++r) std::memcpy(to + r * stride_, from + r * width, width);
    }
  }

 private:
  const GaussianModel& model_;
  const std::vector<Field>& fields_;
  std::vector<std::vector<size_t>> scatters_;
  std::vector<std::pair<const ExtraColumn*, size_t>> extras_;
  size_t stride_ = 0;
};

}  // namespace

std::span<const std::string_view> PlyCodec::Extensions() const {
  static constexpr std::array<std::string_view, 1> extensions = {".ply"};
  return extensions;
}

bool PlyCodec::Sniff(std::string_view head) const {
  return head.starts_with("ply\n") || head.starts_with("ply\r\n");
}

GaussianModel PlyCodec::Read(const std::filesystem::path& path, Monitor& monitor,
                             BadRows bad) const {
  const InputFile file(path);
  std::string head(std::min(file.size(), kMaxPlyHeaderBytes), '\0');
  file.ReadAt(0, head.data(), head.size());
  const PlyHeader header = ParsePlyHeader(head, path);
  RefuseOtherKinds(header, path);

  const PlyElement& vertex = header.elements[0];
  GaussianModel model;
  model.source.comments = header.comments;
  const int degree = InferDegree(vertex, path);
  const std::vector<Field> fields = Fields(degree);
  ColumnOffsets offsets;
  const size_t stride = LayOutRow(vertex, fields, path, offsets, model.source);
  RequireColumns(fields, offsets, path);
  CheckLength(header, stride, file.size(), path);

  const size_t count = vertex.count;
  model.Resize(count, std::min(degree, 3));
  RowReader reader(vertex, fields, offsets, stride, model, path, bad);
  KeepTrailingHeader(header, model.source);
  ReadBody(header, file, stride, reader, monitor, model.source.trailing_bytes);
  return model;
}

void PlyCodec::Write(const std::filesystem::path& path, const GaussianModel& model,
                     Monitor& monitor) const {
  CheckWritable(model, path);
  const std::vector<Field> fields = Fields(FileDegree(model));
  const std::vector<std::string> order = ColumnOrder(model, fields);
  const RowWriter writer(model, fields, order);

  AtomicFile file(path);
  file.Write(HeaderText(model, order));
  const size_t count = model.NumGaussians();
  const size_t rows_a_block = std::max<size_t>(1, kBlockBytes / writer.stride());
  std::vector<char> block(std::min(rows_a_block, count) * writer.stride(), '\0');
  for (size_t first = 0; first < count; first += rows_a_block) {
    monitor.Step("save", static_cast<double>(first), static_cast<double>(count));
    const size_t rows = std::min(rows_a_block, count - first);
    writer.Give(block.data(), first, rows);
    file.Write(block.data(), rows * writer.stride());
  }
  file.Write(model.source.trailing_bytes.data(), model.source.trailing_bytes.size());
  file.Commit();
}

}  // namespace retint
