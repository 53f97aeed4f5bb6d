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
#include "base/input_file.h"
#include "base/ply_header.h"
#include "scene/sh_band4.h"
#include "splat_io/parallel_rows.h"
#include "splat_io/ply_ascii.h"
#include "splat_io/ply_rows.h"
#include "splat_io/splat_row.h"
#include "splat_io/splat_tags.h"

namespace retint {
namespace {

static_assert(std::endian::native == std::endian::little);

constexpr size_t kBlockBytes = size_t{256} << 10;  // of rows at a time; fits the L2 cache

std::string Indexed(std::string_view prefix, int i) {
  return std::string(prefix) + std::to_string(i);
}

int FileDegree(const GaussianModel& model) { return HasShBand4(model) ? 4 : model.sh_degree; }

// The order of columns in the original code.
std::vector<std::string> CanonicalOrder(int sh_degree) {
  std::vector<std::string> order = {"x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2"};
  const int rest = 3 * ((sh_degree + 1) * (sh_degree + 1) - 1);
  for (int i = 0; i < rest; ++i) order.push_back(Indexed("f_rest_", i));
  order.push_back("opacity");
  for (int i = 0; i < 3; ++i) order.push_back(Indexed("scale_", i));
  for (int i = 0; i < 4; ++i) order.push_back(Indexed("rot_", i));
  return order;
}

// ---- Reading

void KeepTrailingHeader(const PlyHeader& header, SourceLayout& source) {
  for (size_t e = 1; e < header.elements.size(); ++e) {
    source.trailing_header.push_back(header.elements[e].ToLine());
    for (const PlyProperty& property : header.elements[e].properties) {
      source.trailing_header.push_back(property.ToLine());
    }
  }
}

// Reads the rows block by block: binary ones as they are, ascii ones converted to binary.
void ReadBody(const PlyHeader& header, const InputFile& file, size_t stride, PlyRowReader& reader,
              Monitor& monitor, SourceLayout& source) {
  std::vector<char>& trailing = source.trailing_bytes;
  const size_t count = header.elements[0].count;
  const size_t rows_a_block = std::max<size_t>(1, kBlockBytes / stride);
  const auto report = [&](size_t done) {
    monitor.Step("load", static_cast<double>(done), static_cast<double>(count));
  };
  if (header.format == "ascii") {
    std::vector<char> block(std::min(rows_a_block, count) * stride);
    PlyAscii ascii(file, header);
    for (size_t first = 0; first < count; first += rows_a_block) {
      report(first);
      const size_t rows = std::min(rows_a_block, count - first);
      ascii.ReadRows(header.elements[0], first, rows, block);
      reader.Take(block.data(), first, rows);
    }
    for (size_t e = 1; e < header.elements.size(); ++e) {
      ascii.ReadElement(header.elements[e], trailing);
    }
    if (!ascii.AtEnd()) {
      source.notes.push_back(file.path().string() + ": text after the last of " +
                             std::to_string(count) + " Gaussians is ignored");
    }
    return;
  }
  ForRows(count, report, [&](size_t begin, size_t end) {
    std::vector<char> block((end - begin) * stride);
    file.ReadAt(header.bytes + begin * stride, block.data(), block.size());
    reader.Take(block.data(), begin, end - begin);
  });
  if (header.elements.size() > 1) {
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

// The source's order of columns, adapted to the model: drops columns that the model no longer has,
// and adds missing ones after the last SH column.
std::vector<std::string> ColumnOrder(const GaussianModel& model,
                                     const std::vector<PlyField>& fields) {
  std::vector<std::string> canonical = CanonicalOrder(FileDegree(model));
  // A disc has no thickness.
  if (model.traits.render_model == RenderModel::k2dgs) std::erase(canonical, "scale_2");
  if (model.source.property_order.empty()) return canonical;
  std::unordered_set<std::string_view> wanted;
  for (const PlyField& field : fields) wanted.insert(field.columns.begin(), field.columns.end());
  std::unordered_set<std::string_view> available = wanted;
  for (const ExtraColumn& extra : model.source.extras) available.insert(extra.name);
  std::vector<std::string> order;
  size_t after_sh = 0;
  for (const std::string& column : model.source.property_order) {
    if (!available.erase(column)) continue;
    order.push_back(column);
    if (IsPlyRest(column) || column == "f_dc_2") after_sh = order.size();
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
  for (const std::string& comment : TaggedComments(model)) text += comment + "\n";
  text += "element vertex " + std::to_string(model.NumGaussians()) + "\n";
  for (const std::string& column : order) {
    const auto found = types.find(column);
    text += "property " + std::string(found == types.end() ? "float" : found->second) + " " +
            column + "\n";
  }
  for (const std::string& line : model.source.trailing_header) text += line + "\n";
  return text + "end_header\n";
}

using ColumnOffsets = std::unordered_map<std::string, size_t>;  // byte offset in a row

class RowWriter {
 public:
  RowWriter(const GaussianModel& model, const std::vector<PlyField>& fields,
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
    for (const PlyField& field : fields) {
      std::vector<size_t>& scatter = scatters_.emplace_back();
      for (const std::string& column : field.columns) {
        const auto found = offsets.find(column);
        scatter.push_back(found == offsets.end() ? SIZE_MAX : found->second);
      }
    }
    for (const ExtraColumn& extra : model.source.extras) {
      const auto found = offsets.find(extra.name);
      if (found != offsets.end()) extras_.emplace_back(&extra, found->second);
    }
  }

  size_t stride() const { return stride_; }

  // Writes rows [first, first + count) to `rows`. Columns without a source (nx ny nz) do not
  // change.
  void Give(char* rows, size_t first, size_t count) const {
    for (size_t f = 0; f < fields_.size(); ++f) {
      const std::vector<size_t>& scatter = scatters_[f];
      const size_t width = scatter.size();
      const float* from = (model_.*fields_[f].values).data() + first * width;
      for (size_t r = 0; r < count; ++r) {
        char* row = rows + r * stride_;
        for (size_t j = 0; j < width; ++j) {
          if (scatter[j] != SIZE_MAX) std::memcpy(row + scatter[j], from + r * width + j, 4);
        }
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
  const std::vector<PlyField>& fields_;
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
  const PlyLayout layout = ReadPlyLayout(file);
  GaussianModel model;
  model.source = layout.source;
  model.Resize(layout.count(), std::min(layout.degree, 3));
  PlyRowReader reader(layout, model, path, bad);
  KeepTrailingHeader(layout.header, model.source);
  ReadBody(layout.header, file, layout.stride, reader, monitor, model.source);
  return model;
}

void PlyCodec::Write(const std::filesystem::path& path, const GaussianModel& model,
                     Monitor& monitor) const {
  CheckWritable(model, path);
  const std::vector<PlyField> fields = PlyFields(FileDegree(model));
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
