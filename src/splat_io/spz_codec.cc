// SPDX-License-Identifier: BSD-3-Clause
#include "splat_io/spz_codec.h"

#include <array>
#include <functional>
#include <future>
#include <limits>
#include <stdexcept>

#include "base/files.h"
#include "scene/sh_band4.h"
#include "splat_io/axes.h"
#include "splat_io/compression.h"
#include "splat_io/input_file.h"
#include "splat_io/parallel_rows.h"
#include "splat_io/splat_row.h"

namespace retint {
namespace {

constexpr const char* kMark = ".spz";  // SourceLayout::packed holds a Packed::bytes
constexpr std::string_view kMagic = "NGSP";
constexpr size_t kHeaderBytes = 16, kHeader4Bytes = 32;
constexpr uint8_t kHasExtensions = 2;
constexpr size_t kMostExtensions = 65536;  // bytes
constexpr uint32_t kCoordinateSystem = 0xADBE0003;
constexpr size_t kBlockRows = 16384;
constexpr float kColorScale = 0.15f;
constexpr float kLeastLogScale = -10, kMostLogScale = 255 / 16.0f - 10;
constexpr double kFixedMost = (1 << 23) - 1;
constexpr int kMostFractionalBits = 16;

#pragma pack(push, 1)
struct Header {
  char magic[4] = {'N', 'G', 'S', 'P'};
  uint32_t version = 3;
  uint32_t count = 0;
  uint8_t sh_degree = 0;
  uint8_t fractional_bits = 12;
  uint8_t flags = 0;
  uint8_t streams = 0;  // version 4
};
#pragma pack(pop)
static_assert(sizeof(Header) == kHeaderBytes);

// The unpacked file: header, the sections one after the other, extensions.
struct Packed {
  Header header;
  std::vector<char> bytes;
  AxisSigns axes = kRightUpBack;

  size_t PositionBytes() const { return header.version == 1 ? 6 : 9; }
  size_t RotationBytes() const { return header.version < 3 ? 3 : 4; }
  size_t ShBytes() const {
    const size_t side = size_t{header.sh_degree} + 1;
    return 3 * (side * side - 1);
  }
  // Bytes a Gaussian: positions, opacities, colors, scales, rotations, SH, in the file's order.
  std::array<size_t, 6> Widths() const {
    return {PositionBytes(), 1, 3, 3, RotationBytes(), ShBytes()};
  }
  size_t SectionAt(size_t section) const {
    size_t at = kHeaderBytes;
    for (size_t s = 0; s < section; ++s) at += Widths()[s] * header.count;
    return at;
  }
  size_t Size() const { return SectionAt(6); }  // without extensions
  char* At(size_t section, size_t g) {
    return bytes.data() + SectionAt(section) + g * Widths()[section];
  }
};

enum Section { kPositions, kOpacities, kColors, kScales, kRotations, kSh };

uint8_t ByteOf(const char* from) { return static_cast<uint8_t>(*from); }

// ---- One Gaussian, in the file's axes

std::array<float, 3> UnpackPosition(const Header& header, const char* from) {
  std::array<float, 3> position;
  for (size_t i = 0; i < 3; ++i) {
    if (header.version == 1) {
      position[i] = HalfToFloat(LoadAs<uint16_t>(from + 2 * i));
      continue;
    }
    // Into the upper three bytes, for the sign.
    const auto bits = static_cast<int32_t>(uint32_t{ByteOf(from + 3 * i)} << 8 |
                                           uint32_t{ByteOf(from + 3 * i + 1)} << 16 |
                                           uint32_t{ByteOf(from + 3 * i + 2)} << 24);
    position[i] = std::ldexp(static_cast<float>(bits >> 8), -header.fractional_bits);
  }
  return position;
}

// False where a value is beyond 24 bits.
bool PackPosition(const std::array<float, 3>& position, int fractional_bits, char* to) {
  for (size_t i = 0; i < 3; ++i) {
    const double fixed = std::round(std::ldexp(double{position[i]}, fractional_bits));
    if (std::abs(fixed) > kFixedMost) return false;
    const auto bits = static_cast<uint32_t>(static_cast<int32_t>(fixed));
    for (size_t b = 0; b < 3; ++b) to[3 * i + b] = static_cast<char>(bits >> (8 * b));
  }
  return true;
}

std::array<float, 4> UnpackRotation(const Header& header, const char* from) {
  std::array<double, 4> xyzw;
  if (header.version < 3) {
    double left = 1;
    for (size_t i = 0; i < 3; ++i) {
      xyzw[i] = ByteOf(from + i) / 127.5 - 1;
      left -= xyzw[i] * xyzw[i];
    }
    xyzw[3] = std::sqrt(std::max(0.0, left));
  } else {
    const auto word = LoadAs<uint32_t>(from);
    SmallestThree packed;
    packed.largest = static_cast<int>(word >> 30);
    for (size_t i = 0; i < 3; ++i) {
      const uint32_t ten = word >> (20 - 10 * i) & 1023u;
      packed.rest[i] = (ten & 512u ? -1 : 1) * std::sqrt(0.5) * (ten & 511u) / 511;
    }
    xyzw = UnpackSmallestThree(packed);
  }
  return {static_cast<float>(xyzw[3]), static_cast<float>(xyzw[0]), static_cast<float>(xyzw[1]),
          static_cast<float>(xyzw[2])};
}

void PackRotation(const Header& header, const std::array<float, 4>& quat_wxyz, char* to) {
  const std::array<double, 4> q = Normalized(quat_wxyz);
  if (header.version < 3) {
    for (size_t i = 0; i < 3; ++i) {
      const double positive = q[0] < 0 ? -q[i + 1] : q[i + 1];
      to[i] = static_cast<char>(RoundTo((positive + 1) * 127.5, 255));
    }
    return;
  }
  const SmallestThree packed = PackSmallestThree({q[1], q[2], q[3], q[0]});
  auto word = static_cast<uint32_t>(packed.largest);
  for (const double value : packed.rest) {
    const uint32_t magnitude = RoundTo(std::abs(value) / std::sqrt(0.5) * 511, 511);
    word = word << 10 | (value < 0 ? 512u : 0u) | magnitude;
  }
  StoreAs(to, word);
}

float UnpackSh(char byte) { return static_cast<float>(static_cast<uint8_t>(byte)) / 128 - 1; }

// 5 bits at degree 1 and 4 above, as the reference keeps: `k` from 1.
char PackSh(float sh, size_t k) {
  const int bucket = k < 4 ? 8 : 16;
  const int fine = static_cast<int>(std::lround(std::clamp(sh, -2.0f, 2.0f) * 128)) + 128;
  const int coarse = (std::max(fine, 0) + bucket / 2) / bucket * bucket;
  return static_cast<char>(std::min(coarse, 255));
}

SplatRow Decode(Packed& packed, size_t g) {
  const Header& header = packed.header;
  SplatRow row;
  row.mean = UnpackPosition(header, packed.At(kPositions, g));
  row.quat_wxyz = UnpackRotation(header, packed.At(kRotations, g));
  row.opacity_logit = LogitOfByte(ByteOf(packed.At(kOpacities, g)));
  const char *scales = packed.At(kScales, g), *colors = packed.At(kColors, g),
             *sh = packed.At(kSh, g);
  for (size_t i = 0; i < 3; ++i) {
    row.log_scale[i] = static_cast<float>(ByteOf(scales + i)) / 16 - 10;
    row.sh[i] = (static_cast<float>(ByteOf(colors + i)) / 255 - 0.5f) / kColorScale;
  }
  const size_t values = std::min<size_t>(packed.ShBytes(), 45);
  for (size_t i = 0; i < values; ++i) row.sh[3 + i] = UnpackSh(sh[i]);
  return FlipAxes(row, packed.axes);
}

// Packs what differs from `was`, everything where that is nullptr; both in the model's axes. False
// where the position does not fit.
bool Encode(Packed& packed, size_t g, const SplatRow& model_row, const SplatRow* was) {
  const SplatRow row = FlipAxes(model_row, packed.axes);
  const Header& header = packed.header;
  if ((!was || model_row.mean != was->mean) &&
      !PackPosition(row.mean, header.fractional_bits, packed.At(kPositions, g))) {
    return false;
  }
  if (!was || model_row.quat_wxyz != was->quat_wxyz) {
    PackRotation(header, row.quat_wxyz, packed.At(kRotations, g));
  }
  if (!was || model_row.opacity_logit != was->opacity_logit) {
    *packed.At(kOpacities, g) = static_cast<char>(RoundTo(255 * Sigmoid(row.opacity_logit), 255));
  }
  for (size_t i = 0; i < 3; ++i) {
    if (!was || model_row.log_scale[i] != was->log_scale[i]) {
      packed.At(kScales, g)[i] =
          static_cast<char>(RoundTo((double{row.log_scale[i]} + 10) * 16, 255));
    }
    if (!was || model_row.sh[i] != was->sh[i]) {
      packed.At(kColors, g)[i] =
          static_cast<char>(RoundTo(255 * (0.5 + double{kColorScale} * row.sh[i]), 255));
    }
  }
  const size_t values = std::min<size_t>(packed.ShBytes(), 45);
  for (size_t i = 0; i < values; ++i) {
    if (was && model_row.sh[3 + i] == was->sh[3 + i]) continue;
    packed.At(kSh, g)[i] = PackSh(row.sh[3 + i], i / 3 + 1);
  }
  return true;
}

// Degree 4, in the model's axes. The parity of its functions in x, y and z: bits 0, 1, 2.
float Band4Sign(const AxisSigns& axes, size_t value) {
  static constexpr std::array<int, 9> kParity = {3, 6, 3, 6, 0, 5, 0, 5, 0};
  float sign = 1;
  for (size_t i = 0; i < 3; ++i) {
    if (kParity[value / 3] >> i & 1) sign *= axes[i];
  }
  return sign;
}

ShBand4 DecodeBand4(Packed& packed, size_t g) {
  ShBand4 values;
  for (size_t i = 0; i < values.size(); ++i) {
    values[i] = Band4Sign(packed.axes, i) * UnpackSh(packed.At(kSh, g)[45 + i]);
  }
  return values;
}

// Packs what differs from `was`, everything where that is nullptr.
void EncodeBand4(Packed& packed, size_t g, const ShBand4& values, const ShBand4* was) {
  for (size_t i = 0; i < values.size(); ++i) {
    if (was && values[i] == (*was)[i]) continue;
    packed.At(kSh, g)[45 + i] = PackSh(Band4Sign(packed.axes, i) * values[i], 16);
  }
}

// ---- Reading

void CheckHeader(const Header& header, uint32_t least_version, uint32_t most_version,
                 uint64_t file_bytes, const std::filesystem::path& path) {
  if (std::string_view(header.magic, 4) != kMagic) throw InputError(path, "not an .spz file");
  if (header.version < least_version || header.version > most_version) {
    throw InputError(path, "SPZ version " + std::to_string(header.version) +
                               " is not supported; supported: gzip of version 1 to 3, and 4");
  }
  if (header.count == 0) throw InputError(path, "holds no Gaussians");
  if (header.sh_degree > 4) {
    throw InputError(path, "SH degree " + std::to_string(header.sh_degree) + ", expected 0 to 4");
  }
  if (header.fractional_bits > 24) {
    throw InputError(path, std::to_string(header.fractional_bits) +
                               " fractional bits of positions, expected 0 to 24");
  }
  Packed layout;
  layout.header = header;
  if (layout.Size() > MostUnpacked(file_bytes)) {
    throw InputError(path, "truncated: the header announces " + std::to_string(header.count) +
                               " Gaussians, more than " + std::to_string(file_bytes) +
                               " bytes can hold");
  }
}

// Calls `work`; what it throws as std::runtime_error is a fault of the file.
template <typename Work>
auto NamingPath(const std::filesystem::path& path, const Work& work) {
  try {
    return work();
  } catch (const Error&) {
    throw;
  } catch (const std::runtime_error& error) {
    throw InputError(path, error.what());
  }
}

// Version 4: a header of 32 bytes, extensions, for each stream its packed and its unpacked length,
// the streams.
void ReadVersion4(const std::string& file, Packed& packed, Monitor& monitor,
                  const std::filesystem::path& path) {
  const Header& header = packed.header;
  ByteReader reader(file, path);
  reader.ReadBytes(kHeaderBytes, "header");
  const auto table_at = reader.Read<uint32_t>("header");
  reader.ReadBytes(12, "header");
  if (table_at < kHeader4Bytes || table_at - kHeader4Bytes > kMostExtensions) {
    throw InputError(path,
                     "the table of streams begins at a wrong byte, " + std::to_string(table_at));
  }
  const std::string_view extensions = reader.ReadBytes(table_at - kHeader4Bytes, "extensions");
  const size_t streams = header.sh_degree > 0 ? 6 : 5;
  if (header.streams != streams) {
    throw InputError(
        path, std::to_string(header.streams) + " streams, expected " + std::to_string(streams));
  }
  std::array<uint64_t, 6> sizes{};
  for (size_t s = 0; s < streams; ++s) {
    sizes[s] = reader.Read<uint64_t>("table of streams");
    if (reader.Read<uint64_t>("table of streams") != packed.Widths()[s] * header.count) {
      throw InputError(path, "stream " + std::to_string(s) + " has not the length of " +
                                 std::to_string(header.count) + " Gaussians");
    }
  }
  std::vector<std::string_view> packed_sections;
  for (size_t s = 0; s < streams; ++s) {
    packed_sections.push_back(reader.ReadBytes(sizes[s], "bytes of a stream"));
  }
  std::vector<std::vector<char>> sections(streams);
  ForEachTask(LargestFirst(packed_sections), [&](size_t s) {
    sections[s] = Unzstd(packed_sections[s], packed.Widths()[s] * header.count,
                         [&] { monitor.Step("load", 0.1, 1); });
  });
  packed.bytes.reserve(packed.Size() + extensions.size());
  packed.bytes.assign(reinterpret_cast<const char*>(&header),
                      reinterpret_cast<const char*>(&header) + kHeaderBytes);
  for (std::vector<char>& section : sections) {
    packed.bytes.insert(packed.bytes.end(), section.begin(), section.end());
    section = {};
  }
  if (reader.Remaining() > 0) {
    throw InputError(path, std::to_string(reader.Remaining()) +
                               " bytes follow the last stream: the file is damaged");
  }
  packed.bytes.insert(packed.bytes.end(), extensions.begin(), extensions.end());
}

// Records of type, length, data. Only the coordinate system matters here.
void ReadExtensions(Packed& packed, const std::filesystem::path& path) {
  const std::string_view tail(packed.bytes.data() + packed.Size(),
                              packed.bytes.size() - packed.Size());
  ByteReader reader(tail, path);
  while (reader.Remaining() > 0) {
    const auto type = reader.Read<uint32_t>("extension");
    const auto length = reader.Read<uint32_t>("extension");
    const std::string_view data = reader.ReadBytes(length, "bytes of an extension");
    if (type != kCoordinateSystem) continue;
    const uint32_t system = data.size() == 4 ? LoadAs<uint32_t>(data.data()) : 0;
    if (system < 1 || system > 8) {
      throw InputError(path, "coordinate system " + std::to_string(system) +
                                 " of SPZ_ADOBE_coordinate_system is not supported; supported: " +
                                 "those without exchanged axes, 1 to 8");
    }
    // Bits of system - 1: right, up, front; the .ply's are right, down, front.
    packed.axes = {(system - 1) & 1 ? 1.0f : -1.0f, (system - 1) & 2 ? -1.0f : 1.0f,
                   (system - 1) & 4 ? 1.0f : -1.0f};
  }
}

// `is_whole_enough` is called with the header, at most once, when half of the data has come out: by
// then the file is not one that merely announces much.
Packed Unpack(const std::string& file, const std::filesystem::path& path, Monitor& monitor,
              const std::function<void(const Header&)>& is_whole_enough) {
  Packed packed;
  bool told = false;
  const auto load_header = [&](std::string_view from) {
    if (from.size() < kHeaderBytes) throw InputError(path, "truncated: the header is not whole");
    std::memcpy(&packed.header, from.data(), kHeaderBytes);
  };
  const auto most = [&] { return packed.Size() + kMostExtensions; };
  if (file.starts_with(kMagic)) {
    load_header(file);
    CheckHeader(packed.header, 1, 4, file.size(), path);
    if (packed.header.version == 4) {
      ReadVersion4(file, packed, monitor, path);
    } else {
      packed.bytes.assign(file.begin(), file.end());
    }
  } else {
    packed.bytes = Gunzip(
        file, kHeaderBytes,
        [&](std::string_view head) {
          load_header(head);
          CheckHeader(packed.header, 1, 3, file.size(), path);
          return most();
        },
        [&](size_t done) {
          monitor.Step("load", 0.5 * static_cast<double>(done), static_cast<double>(most()));
          if (told || done < most() / 2) return;
          told = true;
          is_whole_enough(packed.header);
        });
  }
  if (packed.bytes.size() < packed.Size()) {
    throw InputError(path, "truncated: the header announces " +
                               std::to_string(packed.header.count) + " Gaussians, " +
                               std::to_string(packed.bytes.size() - kHeaderBytes) +
                               " bytes follow it");
  }
  if (packed.header.flags & kHasExtensions) {
    ReadExtensions(packed, path);
  } else if (packed.bytes.size() > packed.Size()) {
    throw InputError(path, std::to_string(packed.bytes.size() - packed.Size()) +
                               " bytes follow the last value: the file is damaged");
  }
  return packed;
}

// ---- Writing

int FileDegree(const GaussianModel& model) { return HasShBand4(model) ? 4 : model.sh_degree; }

// What the model's source holds, where it may be written again with the model's values.
bool LoadSource(const GaussianModel& model, Packed& packed) {
  const SourceLayout& source = model.source;
  if (source.packed_format != kMark || source.packed.size() < kHeaderBytes) return false;
  std::memcpy(&packed.header, source.packed.data(), kHeaderBytes);
  if (packed.header.version < 2 || packed.header.count != model.NumGaussians() ||
      packed.header.sh_degree != FileDegree(model) || source.packed.size() < packed.Size()) {
    return false;
  }
  packed.bytes = source.packed;
  if (packed.header.flags & kHasExtensions) ReadExtensions(packed, "source");
  return true;
}

Packed NewFile(const GaussianModel& model) {
  Packed packed;
  packed.header.count = static_cast<uint32_t>(model.NumGaussians());
  packed.header.sh_degree = static_cast<uint8_t>(FileDegree(model));
  if (packed.header.sh_degree == 4) {  // which earlier versions do not have
    packed.header.version = 4;
    packed.header.streams = 6;
  }
  double farthest = 0;
  for (const float x : model.means) farthest = std::max(farthest, std::abs(double{x}));
  int bits = kMostFractionalBits;
  while (bits > 0 && std::ldexp(farthest, bits) > kFixedMost) --bits;
  packed.header.fractional_bits = static_cast<uint8_t>(bits);
  packed.bytes.assign(packed.Size(), '\0');
  std::memcpy(packed.bytes.data(), &packed.header, kHeaderBytes);
  return packed;
}

void WriteVersion4(Packed& packed, Monitor& monitor, AtomicFile& file) {
  const size_t streams = packed.header.streams;
  const auto extensions = packed.bytes.begin() + static_cast<std::ptrdiff_t>(packed.Size());
  file.Write(&packed.header, kHeaderBytes);
  file.WriteValue(static_cast<uint32_t>(kHeader4Bytes + (packed.bytes.end() - extensions)));
  file.Write(std::string(12, '\0'));
  file.Write(packed.bytes.data() + packed.Size(), packed.bytes.size() - packed.Size());
  std::vector<std::vector<char>> packed_streams;
  for (size_t s = 0; s < streams; ++s) {
    monitor.Step("save", 0.5 + 0.5 * static_cast<double>(s) / static_cast<double>(streams), 1);
    const size_t bytes = packed.Widths()[s] * packed.header.count;
    packed_streams.push_back(Zstd({packed.At(s, 0), bytes}));
    file.WriteValue(uint64_t{packed_streams.back().size()});
    file.WriteValue(uint64_t{bytes});
  }
  for (const std::vector<char>& stream : packed_streams) file.Write(stream.data(), stream.size());
}

}  // namespace

std::span<const std::string_view> SpzCodec::Extensions() const {
  static constexpr std::array<std::string_view, 1> extensions = {".spz"};
  return extensions;
}

bool SpzCodec::Sniff(std::string_view head) const {
  if (head.starts_with(kMagic)) return true;
  if (!head.starts_with("\x1f\x8b")) return false;
  // A file that is cut off early may show less than the magic, or nothing.
  const std::vector<char> start = GunzipHead(head, kMagic.size());
  return kMagic.starts_with(std::string_view(start.data(), start.size()));
}

GaussianModel SpzCodec::Read(const std::filesystem::path& path, Monitor& monitor,
                             BadRows bad) const {
  monitor.Step("load", 0, 1);
  const std::string file = ReadFile(path);
  GaussianModel model;
  // Memory for the Gaussians is made ready beside the rest of the unpacking, which has one thread.
  std::future<void> resized;
  const auto resize = [&](const Header& header) {
    resized = std::async(std::launch::async, [&model, count = size_t{header.count},
                                              degree = std::min<int>(header.sh_degree, 3)] {
      model.Resize(count, degree);
    });
  };
  Packed packed = NamingPath(path, [&] { return Unpack(file, path, monitor, resize); });
  if (!resized.valid()) resize(packed.header);
  resized.get();
  const size_t count = packed.header.count;
  if (packed.header.sh_degree > 3) ShBand4Columns::AddTo(model);
  ShBand4Columns band4(model);
  const auto report = [&](size_t done) {
    monitor.Step("load", static_cast<double>(count + done), 2.0 * static_cast<double>(count));
  };
  ForRows(count, report, [&](size_t begin, size_t end) {
    for (size_t g = begin; g < end; ++g) {
      SetRow(model, g, Decode(packed, g));
      if (band4.present()) band4.Set(g, DecodeBand4(packed, g));
    }
  });
  ValidateRead(model, path, bad);
  model.source.packed_format = kMark;
  model.source.packed = std::move(packed.bytes);
  return model;
}

void SpzCodec::Write(const std::filesystem::path& path, const GaussianModel& model,
                     Monitor& monitor) const {
  ValidateWrite(model, path);
  if (model.NumGaussians() > std::numeric_limits<int32_t>::max()) {
    throw RunError(path.string() + ": not written: too many Gaussians for an .spz");
  }
  Packed packed;
  const bool patch = LoadSource(model, packed);
  if (!patch) packed = NewFile(model);
  const size_t count = packed.header.count;
  GaussianModel columns;  // those of degree 4 alone
  if (packed.header.sh_degree > 3) {
    columns.sh_degree = 3;
    columns.opacity_logits = model.opacity_logits;
    columns.source.extras = model.source.extras;
  }
  const ShBand4Columns band4(columns);
  for (size_t g = 0; g < count; ++g) {
    if (g % kBlockRows == 0) {
      monitor.Step("save", static_cast<double>(g), 2.0 * static_cast<double>(count));
    }
    SplatRow was;
    if (patch) was = Decode(packed, g);
    if (!Encode(packed, g, GetRow(model, g), patch ? &was : nullptr)) {
      throw RunError(path.string() + ": not written: Gaussian " + std::to_string(g) +
                     ": mean is beyond the range of the .spz's positions");
    }
    if (!band4.present()) continue;
    ShBand4 old;
    if (patch) old = DecodeBand4(packed, g);
    EncodeBand4(packed, g, band4.Get(g), patch ? &old : nullptr);
  }
  AtomicFile file(path);
  if (packed.header.version == 4) {
    WriteVersion4(packed, monitor, file);
  } else {
    const double total = 2.0 * static_cast<double>(packed.bytes.size());
    const std::vector<char> bytes = Gzip(
        {packed.bytes.data(), packed.bytes.size()},
        [&](size_t done) { monitor.Step("save", total / 2 + static_cast<double>(done), total); });
    file.Write(bytes.data(), bytes.size());
  }
  file.Commit();
}

std::vector<std::string> SpzCodec::Losses(const GaussianModel& model) const {
  std::vector<std::string> losses = CommonLosses(model, 4, Name());
  const auto clamped = [&](const std::vector<float>& values, size_t width, float least,
                           float most) {
    size_t gaussians = 0;
    for (size_t g = 0; g < model.NumGaussians(); ++g) {
      const auto from = values.begin() + static_cast<std::ptrdiff_t>(g * width);
      gaussians += std::any_of(from, from + static_cast<std::ptrdiff_t>(width),
                               [&](float x) { return x < least || x > most; });
    }
    return gaussians;
  };
  const size_t scales = clamped(model.log_scales, 3, kLeastLogScale, kMostLogScale);
  if (scales > 0) {
    losses.push_back("scales of " + std::to_string(scales) +
                     " Gaussians lie beyond e^-10 to e^5.9 and are clamped to it");
  }
  return losses;
}

}  // namespace retint
