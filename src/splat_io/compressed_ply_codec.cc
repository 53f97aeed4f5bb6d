// SPDX-License-Identifier: BSD-3-Clause
#include "splat_io/compressed_ply_codec.h"

#include <array>
#include <atomic>
#include <numeric>

#include "base/files.h"
#include "base/input_file.h"
#include "base/memory.h"
#include "base/ply_header.h"
#include "scene/morton.h"
#include "splat_io/parallel_rows.h"
#include "splat_io/ply_rows.h"
#include "splat_io/row_vectors.h"
#include "splat_io/splat_row.h"
#include "splat_io/splat_tags.h"

namespace retint {
namespace {

constexpr const char* kMark = "compressed .ply ";  // and the number of floats per chunk
constexpr size_t kChunkRows = 256;
constexpr size_t kChunksAPiece = 4;  // a piece stays in a core's cache
constexpr size_t kLeastPiecesAReport = 32, kMostReports = 64;
constexpr size_t kVertexBytes = 16;
constexpr size_t kPosition = 0, kScale = 6, kColor = 12;  // bounds in a chunk: 3 least, 3 most
constexpr std::array<const char*, 18> kChunkColumns = {
    "min_x",       "min_y",       "min_z",       "max_x",       "max_y",       "max_z",
    "min_scale_x", "min_scale_y", "min_scale_z", "max_scale_x", "max_scale_y", "max_scale_z",
    "min_r",       "min_g",       "min_b",       "max_r",       "max_g",       "max_b"};
constexpr std::array<const char*, 4> kVertexColumns = {"packed_position", "packed_rotation",
                                                       "packed_scale", "packed_color"};

// Offsets of the parts in the file's body.
struct Layout {
  size_t count = 0;
  size_t chunk_floats = 18;  // or 12
  int sh_degree = 0;

  size_t NumChunks() const { return (count + kChunkRows - 1) / kChunkRows; }
  size_t ShBytes() const {
    return static_cast<size_t>(3 * ((sh_degree + 1) * (sh_degree + 1) - 1));
  }
  size_t ChunkAt(size_t chunk) const { return chunk * chunk_floats * 4; }
  size_t VertexAt(size_t g) const { return ChunkAt(NumChunks()) + g * kVertexBytes; }
  size_t ShAt(size_t g) const { return VertexAt(count) + g * ShBytes(); }
  size_t Bytes() const { return ShAt(count); }
  // The part that SourceLayout::packed keeps. Spherical harmonics are not in it: each byte has its
  // own float and follows from that.
  size_t KeptBytes() const { return VertexAt(count); }
};

// ---- One Gaussian

// The step of `value` among `most` steps from `low` to `high`.
uint32_t Step(double value, double low, double high, uint32_t most) {
  return high > low ? RoundTo((value - low) / (high - low) * most, most) : 0;
}

constexpr std::array<uint32_t, 3> kBits = {11, 10, 11};
constexpr std::array<uint32_t, 3> kShift = {21, 11, 0};

uint32_t Pack(const std::array<float, 3>& values, const ChunkBounds& bounds, size_t which) {
  uint32_t word = 0;
  for (size_t i = 0; i < 3; ++i) {
    const uint32_t most = (1u << kBits[i]) - 1;
    word |= Step(values[i], bounds[which + i], bounds[which + 3 + i], most) << kShift[i];
  }
  return word;
}

uint32_t PackRotation(const std::array<float, 4>& quat_wxyz) {
  const SmallestThree packed = PackSmallestThree(Normalized(quat_wxyz));
  auto word = static_cast<uint32_t>(packed.largest);
  for (const double q : packed.rest) {
    word = (word << 10) | RoundTo((q / std::sqrt(2.0) + 0.5) * 1023, 1023);
  }
  return word;
}

float ColorOf(float sh0) { return 0.5f + kShC0 * sh0; }

constexpr std::array<float, 256> kShOfByte = [] {
  std::array<float, 256> table{};
  for (size_t i = 0; i < 256; ++i) table[i] = ((static_cast<float>(i) + 0.5f) / 256 - 0.5f) * 8;
  table[0] = -4;
  table[255] = 4;
  return table;
}();

uint8_t PackSh(float sh) {
  return static_cast<uint8_t>(std::clamp(std::floor((sh / 8 + 0.5) * 256), 0.0, 255.0));
}

// From [3, kRest] to [kRest, 3], beyond the first three values of each row.
template <size_t kRest>
void DecodeSh(const char* from, size_t count, float* sh) {
  for (size_t g = 0; g < count; ++g, from += 3 * kRest, sh += 3 * (kRest + 1)) {
    for (size_t k = 0; k < kRest; ++k) {
      for (size_t c = 0; c < 3; ++c) {
        sh[3 * (k + 1) + c] = kShOfByte[static_cast<uint8_t>(from[c * kRest + k])];
      }
    }
  }
}

// The higher bands of `count` Gaussians; `sh` is the first one's.
void DecodeSh(const char* bytes, size_t count, int degree, float* sh) {
  if (degree == 1) DecodeSh<3>(bytes, count, sh);
  if (degree == 2) DecodeSh<8>(bytes, count, sh);
  if (degree == 3) UnpackShOfDegree3(bytes, count, sh);
}

void EncodeSh(const float* sh, size_t rest, char* bytes) {
  for (size_t k = 0; k < rest; ++k) {
    for (size_t c = 0; c < 3; ++c) {
      bytes[c * rest + k] = static_cast<char>(PackSh(sh[3 * (k + 1) + c]));
    }
  }
}

// Chunks and vertices.
class Body {
 public:
  Body(Layout layout, UnsetVector<char>& bytes) : layout_(layout), bytes_(bytes) {}

  ChunkBounds BoundsOf(size_t chunk) const {
    ChunkBounds bounds{};
    std::fill(bounds.begin() + kColor + 3, bounds.end(), 1.0f);
    std::memcpy(bounds.data(), bytes_.data() + layout_.ChunkAt(chunk), layout_.chunk_floats * 4);
    return bounds;
  }
  void SetChunkBounds(size_t chunk, const ChunkBounds& bounds) {
    std::memcpy(bytes_.data() + layout_.ChunkAt(chunk), bounds.data(), layout_.chunk_floats * 4);
  }

  // The vertices [begin, end) of one chunk. `to`: the first one's places in a model of
  // `sh_degree`.
  void Decode(size_t begin, size_t end, const ChunkBounds& bounds, const RowPlaces& to,
              int sh_degree) const {
    const size_t sh_values = 3 * static_cast<size_t>((sh_degree + 1) * (sh_degree + 1));
    UnpackVertices(bytes_.data() + layout_.VertexAt(begin), end - begin, bounds, to, sh_values);
  }

  // Packs the values that differ from `was`, or all if `was` is nullptr, within `bounds`. Skips
  // higher bands.
  void Encode(size_t g, const SplatRow& row, const SplatRow* was, const ChunkBounds& bounds) {
    if (!was || row.mean != was->mean) SetWord(g, 0, Pack(row.mean, bounds, kPosition));
    if (!was || row.quat_wxyz != was->quat_wxyz) SetWord(g, 1, PackRotation(row.quat_wxyz));
    if (!was || row.log_scale != was->log_scale) {
      SetWord(g, 2, Pack(row.log_scale, bounds, kScale));
    }
    uint32_t color = Word(g, 3);
    for (size_t i = 0; i < 3; ++i) {
      if (was && row.sh[i] == was->sh[i]) continue;
      const uint32_t shift = 24 - 8 * static_cast<uint32_t>(i);
      const uint32_t step =
          Step(ColorOf(row.sh[i]), bounds[kColor + i], bounds[kColor + 3 + i], 255);
      color = (color & ~(255u << shift)) | step << shift;
    }
    if (!was || row.opacity_logit != was->opacity_logit) {
      color = (color & ~255u) | RoundTo(255 * Sigmoid(row.opacity_logit), 255);
    }
    SetWord(g, 3, color);
  }

 private:
  uint32_t Word(size_t g, size_t which) const {
    return LoadAs<uint32_t>(bytes_.data() + layout_.VertexAt(g) + 4 * which);
  }
  void SetWord(size_t g, size_t which, uint32_t word) {
    StoreAs(bytes_.data() + layout_.VertexAt(g) + 4 * which, word);
  }

  Layout layout_;
  UnsetVector<char>& bytes_;
};

// ---- Header

void RequireColumns(const PlyElement& element, std::span<const char* const> names,
                    std::initializer_list<std::string_view> types,
                    const std::filesystem::path& path) {
  for (size_t i = 0; i < element.properties.size(); ++i) {
    const PlyProperty& property = element.properties[i];
    if (i < names.size() && property.name == names[i] &&
        std::find(types.begin(), types.end(), property.type) != types.end()) {
      continue;
    }
    throw InputError(path, property.line,
                     "property " + property.type + " " + property.name + " of element " +
                         element.name + " is not the compressed .ply's" +
                         (i < names.size() ? std::string(", expected ") + names[i] : ""));
  }
}

int ShDegree(const PlyElement& sh, const std::filesystem::path& path) {
  const size_t values = sh.properties.size();
  std::vector<std::string> names(values);
  std::vector<const char*> expected(values);
  for (size_t i = 0; i < values; ++i) {
    names[i] = "f_rest_" + std::to_string(i);
    expected[i] = names[i].c_str();
  }
  RequireColumns(sh, expected, {"uchar", "uint8"}, path);
  for (int degree = 1; degree <= 3; ++degree) {
    if (values == static_cast<size_t>(3 * ((degree + 1) * (degree + 1) - 1))) return degree;
  }
  throw InputError(path, sh.line,
                   std::to_string(values) +
                       " properties of element sh; 9, 24 or 45 make an SH degree of 1 to 3");
}

Layout ReadLayout(const PlyHeader& header, const std::filesystem::path& path) {
  if (header.format != "binary_little_endian") {
    throw InputError(path, "a compressed .ply of format " + header.format.substr(0, 40) +
                               " is not supported; supported: binary_little_endian");
  }
  const auto& elements = header.elements;
  if (elements.size() < 2 || elements.size() > 3 || elements[0].name != "chunk" ||
      elements[1].name != "vertex" || (elements.size() == 3 && elements[2].name != "sh")) {
    throw InputError(path, "a compressed .ply has the elements chunk, vertex and, it may be, sh");
  }
  Layout layout;
  layout.count = elements[1].count;
  layout.chunk_floats = elements[0].properties.size();
  if (layout.chunk_floats != 12 && layout.chunk_floats != 18) {
    throw InputError(
        path, elements[0].line,
        std::to_string(layout.chunk_floats) + " properties of element chunk, expected 12 or 18");
  }
  RequireColumns(elements[0], kChunkColumns, {"float", "float32"}, path);
  RequireColumns(elements[1], kVertexColumns, {"uint", "uint32"}, path);
  if (elements[1].properties.size() != kVertexColumns.size()) {
    throw InputError(path, elements[1].line, "element vertex lacks packed values");
  }
  if (elements.size() == 3) layout.sh_degree = ShDegree(elements[2], path);
  return layout;
}

void CheckLength(const PlyHeader& header, const Layout& layout, uint64_t file_bytes,
                 const std::filesystem::path& path) {
  const uint64_t body = file_bytes - header.bytes;
  if (layout.count == 0) throw InputError(path, "holds no Gaussians");
  if (layout.count > body / kVertexBytes || layout.Bytes() > body) {
    throw InputError(path, "truncated: the header announces " + std::to_string(layout.count) +
                               " Gaussians, " + std::to_string(body) + " bytes follow it");
  }
  if (header.elements[0].count != layout.NumChunks() ||
      (layout.sh_degree > 0 && header.elements[2].count != layout.count)) {
    throw InputError(path, "chunks or spherical harmonics do not match the " +
                               std::to_string(layout.count) + " Gaussians");
  }
}

std::string HeaderText(const GaussianModel& model, const Layout& layout) {
  std::string text = "ply\nformat binary_little_endian 1.0\n";
  for (const std::string& comment : TaggedComments(model)) text += comment + "\n";
  text += "element chunk " + std::to_string(layout.NumChunks()) + "\n";
  for (size_t i = 0; i < layout.chunk_floats; ++i) {
    text += std::string("property float ") + kChunkColumns[i] + "\n";
  }
  text += "element vertex " + std::to_string(layout.count) + "\n";
  for (const char* column : kVertexColumns) text += std::string("property uint ") + column + "\n";
  if (layout.sh_degree > 0) text += "element sh " + std::to_string(layout.count) + "\n";
  for (size_t i = 0; i < layout.ShBytes(); ++i) {
    text += "property uchar f_rest_" + std::to_string(i) + "\n";
  }
  return text + "end_header\n";
}

// Whether all values between such bounds are finite, as colors and as coefficients.
bool AreModest(const ChunkBounds& bounds) {
  return std::all_of(bounds.begin(), bounds.end(), [](float b) { return std::abs(b) < 1e37f; });
}

// ---- Writing

ChunkBounds NoBounds() {
  ChunkBounds bounds;
  for (size_t i = 0; i < bounds.size(); ++i) {
    bounds[i] = i / 3 % 2 == 0 ? INFINITY : -INFINITY;
  }
  return bounds;
}

void Include(ChunkBounds& bounds, size_t which, size_t axis, float value) {
  bounds[which + axis] = std::min(bounds[which + axis], value);
  bounds[which + 3 + axis] = std::max(bounds[which + 3 + axis], value);
}

float KeptScale(float log_scale) { return std::clamp(log_scale, -20.0f, 20.0f); }

// The first Gaussian of a chunk and the one after its last.
std::pair<size_t, size_t> ChunkRange(const Layout& layout, size_t chunk) {
  return {chunk * kChunkRows, std::min(layout.count, (chunk + 1) * kChunkRows)};
}

void EncodeChunk(const GaussianModel& model, const std::vector<uint32_t>& order, size_t chunk,
                 const Layout& layout, Body& body) {
  const auto [begin, end] = ChunkRange(layout, chunk);
  ChunkBounds bounds = NoBounds();
  for (size_t g = begin; g < end; ++g) {
    const SplatRow row = GetRow(model, order[g]);
    for (size_t i = 0; i < 3; ++i) {
      Include(bounds, kPosition, i, row.mean[i]);
      Include(bounds, kScale, i, KeptScale(row.log_scale[i]));
      Include(bounds, kColor, i, ColorOf(row.sh[i]));
    }
  }
  body.SetChunkBounds(chunk, bounds);
  for (size_t g = begin; g < end; ++g) body.Encode(g, GetRow(model, order[g]), nullptr, bounds);
}

// Whether one of three changed values lies outside its bounds, which then grow. An unpacked bound
// may differ from itself by one float step.
bool Grow(ChunkBounds& bounds, size_t which, const std::array<float, 3>& now,
          const std::array<float, 3>& was) {
  bool grown = false;
  for (size_t i = 0; i < 3; ++i) {
    const float low = bounds[which + i], high = bounds[which + 3 + i];
    const float slack = 1e-6f * std::max({1.0f, std::abs(low), std::abs(high)});
    if (now[i] == was[i] || (now[i] >= low - slack && now[i] <= high + slack)) continue;
    Include(bounds, which, i, now[i]);
    grown = true;
  }
  return grown;
}

std::array<float, 3> ColorsOf(const SplatRow& row) {
  return {ColorOf(row.sh[0]), ColorOf(row.sh[1]), ColorOf(row.sh[2])};
}

// Rewrites the bytes of values that differ from the model's.
void PatchChunk(const GaussianModel& model, size_t chunk, const Layout& layout, Body& body) {
  const auto [begin, end] = ChunkRange(layout, chunk);
  const ChunkBounds old_bounds = body.BoundsOf(chunk);
  ChunkBounds bounds = old_bounds;
  GaussianModel unpacked;
  unpacked.Resize(end - begin, 0);
  body.Decode(begin, end, old_bounds, RowPlaces(unpacked, 0), 0);
  std::vector<SplatRow> was(end - begin);
  for (size_t i = 0; i < was.size(); ++i) was[i] = GetRow(unpacked, i);
  bool moved = false, scaled = false, colored = false;
  for (size_t g = begin; g < end; ++g) {
    SplatRow row = GetRow(model, g);
    const SplatRow& old = was[g - begin];
    for (size_t i = 0; i < 3; ++i) {
      if (row.log_scale[i] != old.log_scale[i]) row.log_scale[i] = KeptScale(row.log_scale[i]);
    }
    moved |= Grow(bounds, kPosition, row.mean, old.mean);
    scaled |= Grow(bounds, kScale, row.log_scale, old.log_scale);
    if (layout.chunk_floats == 18) {
      colored |= Grow(bounds, kColor, ColorsOf(row), ColorsOf(old));
    }
  }
  body.SetChunkBounds(chunk, bounds);
  for (size_t g = begin; g < end; ++g) {
    SplatRow& old = was[g - begin];
    // Values that equal no float are packed again.
    if (moved) old.mean.fill(NAN);
    if (scaled) old.log_scale.fill(NAN);
    if (colored) std::fill_n(old.sh.begin(), 3, NAN);
    body.Encode(g, GetRow(model, g), &old, bounds);
  }
}

// The higher bands, [3, rest] bytes a Gaussian, in `order`; empty: the model's order.
void WriteSh(const GaussianModel& model, const std::vector<uint32_t>& order, size_t rest,
             AtomicFile& file) {
  constexpr size_t kBlockRows = 8192;  // written at a time
  const size_t count = model.NumGaussians();
  std::vector<char> block;
  for (size_t first = 0; first < count; first += kBlockRows) {
    const size_t rows = std::min(kBlockRows, count - first);
    block.resize(rows * 3 * rest);
    for (size_t i = 0; i < rows; ++i) {
      const size_t g = order.empty() ? first + i : order[first + i];
      EncodeSh(&model.sh[g * 3 * (rest + 1)], rest, block.data() + i * 3 * rest);
    }
    file.Write(block.data(), block.size());
  }
}

bool ComesFrom(const GaussianModel& model, const Layout& layout) {
  return model.source.packed_format == kMark + std::to_string(layout.chunk_floats) &&
         model.source.packed.size() == layout.KeptBytes();
}

Layout LayoutFor(const GaussianModel& model) {
  Layout layout;
  layout.count = model.NumGaussians();
  layout.sh_degree = model.sh_degree;
  layout.chunk_floats = 12;
  if (!ComesFrom(model, layout)) layout.chunk_floats = 18;
  return layout;
}

}  // namespace

std::span<const std::string_view> CompressedPlyCodec::Extensions() const {
  static constexpr std::array<std::string_view, 1> extensions = {".compressed.ply"};
  return extensions;
}

bool CompressedPlyCodec::Sniff(std::string_view head) const {
  if (!head.starts_with("ply\n") && !head.starts_with("ply\r\n")) return false;
  return head.find("\nelement chunk ") < head.find("end_header") &&
         head.find(" packed_position") != std::string_view::npos;
}

GaussianModel CompressedPlyCodec::Read(const std::filesystem::path& path, Monitor& monitor,
                                       BadRows bad) const {
  const InputFile file(path);
  std::string head(std::min(file.size(), kMaxPlyHeaderBytes), '\0');
  file.ReadAt(0, head.data(), head.size());
  const PlyHeader header = ParsePlyHeader(head, path);
  const Layout layout = ReadLayout(header, path);
  CheckLength(header, layout, file.size(), path);

  GaussianModel model;
  if (const uint64_t body = file.size() - header.bytes; body > layout.Bytes()) {
    model.source.notes.push_back(BytesLeftOut(path, body - layout.Bytes(), layout.count));
  }
  model.source.comments = header.comments;
  ReadTags(model);
  NoteRenderModel(model);
  model.source.packed_format = kMark + std::to_string(layout.chunk_floats);
  ReservePopulated(model.source.packed, layout.KeptBytes());
  model.source.packed.resize(layout.KeptBytes());
  model.ResizeUnset(layout.count, layout.sh_degree);
  const Body body(layout, model.source.packed);
  const auto report = [&](size_t chunk) {
    monitor.Step("load", static_cast<double>(chunk), static_cast<double>(layout.NumChunks()));
  };
  const auto read = [&](size_t begin, size_t end) {
    file.ReadAt(header.bytes + begin, model.source.packed.data() + begin, end - begin);
  };
  std::atomic<bool> modest = true;
  const auto decode = [&](size_t first, size_t last) {
    const size_t first_row = ChunkRange(layout, first).first;
    const size_t last_row = ChunkRange(layout, last - 1).second;
    read(layout.ChunkAt(first), layout.ChunkAt(last));
    read(layout.VertexAt(first_row), layout.VertexAt(last_row));
    thread_local std::vector<char> sh;
    sh.resize(layout.ShAt(last_row) - layout.ShAt(first_row));
    file.ReadAt(header.bytes + layout.ShAt(first_row), sh.data(), sh.size());
    for (size_t chunk = first; chunk < last; ++chunk) {
      const ChunkBounds bounds = body.BoundsOf(chunk);
      const auto [begin, end] = ChunkRange(layout, chunk);
      const RowPlaces to(model, begin);
      body.Decode(begin, end, bounds, to, layout.sh_degree);
      DecodeSh(sh.data() + (begin - first_row) * layout.ShBytes(), end - begin, layout.sh_degree,
               to.sh);
      if (!AreModest(bounds)) modest = false;
    }
  };
  // Threads wait for each other at each report.
  const size_t pieces = layout.NumChunks() / kChunksAPiece;
  ForRows(layout.NumChunks(), report, decode, kChunksAPiece,
          std::max(kLeastPiecesAReport, pieces / kMostReports));
  if (!modest) ValidateRead(model, path, bad);
  return model;
}

void CompressedPlyCodec::Write(const std::filesystem::path& path, const GaussianModel& model,
                               Monitor& monitor) const {
  ValidateWrite(model, path);
  const Layout layout = LayoutFor(model);
  const bool patch = ComesFrom(model, layout);
  UnsetVector<char> bytes = model.source.packed;
  if (!patch) bytes.assign(layout.KeptBytes(), 0);
  Body body(layout, bytes);
  const std::vector<uint32_t> order = patch ? std::vector<uint32_t>() : WriteOrder(model);
  for (size_t chunk = 0; chunk < layout.NumChunks(); ++chunk) {
    monitor.Step("save", static_cast<double>(chunk), static_cast<double>(layout.NumChunks()));
    if (patch) {
      PatchChunk(model, chunk, layout, body);
    } else {
      EncodeChunk(model, order, chunk, layout, body);
    }
  }
  AtomicFile file(path);
  file.Write(HeaderText(model, layout));
  file.Write(bytes.data(), bytes.size());
  const size_t rest = layout.ShBytes() / 3;
  if (rest > 0) WriteSh(model, order, rest, file);
  file.Commit();
}

std::vector<std::string> CompressedPlyCodec::Losses(const GaussianModel& model) const {
  return CommonLosses(model, 3, Name(), kAllRenderModels, kAllColorSpaces);
}

std::vector<uint32_t> CompressedPlyCodec::WriteOrder(const GaussianModel& model) const {
  if (ComesFrom(model, LayoutFor(model))) return {};
  return MortonOrder(model.means);
}

}  // namespace retint
