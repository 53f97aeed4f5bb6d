// SPDX-License-Identifier: BSD-3-Clause
#include "splat_io/spz_codec.h"

#include <array>
#include <atomic>
#include <chrono>
#include <future>
#include <limits>
#include <stdexcept>

#include "base/files.h"
#include "base/input_file.h"
#include "scene/sh_band4.h"
#include "splat_io/compression.h"
#include "splat_io/parallel_rows.h"
#include "splat_io/splat_row.h"
#include "splat_io/spz_rows.h"

namespace retint {
namespace {

constexpr const char* kMark = ".spz";  // SourceLayout::packed holds SpzData::bytes
constexpr std::string_view kMagic = "NGSP";
constexpr size_t kHeader4Bytes = 32;
constexpr uint8_t kAntialiased = 1, kHasExtensions = 2;  // flags
constexpr size_t kMostExtensions = 65536;                // bytes
constexpr uint32_t kCoordinateSystem = 0xADBE0003;
constexpr size_t kBlockRows = 16384;
constexpr float kLeastLogScale = -10, kMostLogScale = 255 / 16.0f - 10;
constexpr int kMostFractionalBits = 16;

// ---- Reading

void CheckHeader(const SpzHeader& header, uint32_t least_version, uint32_t most_version,
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
  SpzData layout;
  layout.header = header;
  if (layout.Size() > MostUnpacked(file_bytes)) {
    throw InputError(path, "truncated: the header announces " + std::to_string(header.count) +
                               " Gaussians, more than " + std::to_string(file_bytes) +
                               " bytes can hold");
  }
}

// Calls `work`; turns its std::runtime_error into an InputError of the file.
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

// Version 4: a header of 32 bytes, extensions, packed and unpacked length of each stream, then the
// streams.
void ReadVersion4(const std::string& file, SpzData& packed, Monitor& monitor,
                  const std::filesystem::path& path) {
  const SpzHeader& header = packed.header;
  ByteReader reader(file, path);
  reader.ReadBytes(kSpzHeaderBytes, "header");
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
                      reinterpret_cast<const char*>(&header) + kSpzHeaderBytes);
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

// Extensions have type, length and data. Only the coordinate system matters here.
void ReadExtensions(SpzData& packed, const std::filesystem::path& path) {
  const std::string_view tail(packed.bytes.data() + packed.Size(),
                              packed.bytes.size() - packed.Size());
  ByteReader reader(tail, path);
  while (reader.Remaining() > 0) {
    const auto type = reader.Read<uint32_t>("extension");
    const auto length = reader.Read<uint32_t>("extension");
    const std::string_view data = reader.ReadBytes(length, "bytes of an extension");
    if (type != kCoordinateSystem) continue;
    const uint32_t system = data.size() == 4 ? LoadAs<uint32_t>(data.data()) : 0;
    if (system < 1 || system > 16) {
      throw InputError(
          path, "coordinate system " + std::to_string(system) +
                    " of SPZ_ADOBE_coordinate_system is not supported; supported: " + "1 to 16");
    }
    // The bits of system - 1 say right, up, front, and whether y is depth; the .ply is right, down,
    // front. A turn of y to -z swaps front and back.
    packed.turned = (system - 1) & 8;
    const bool front = packed.turned != (((system - 1) & 4) != 0);
    packed.axes = {(system - 1) & 1 ? 1.0f : -1.0f, (system - 1) & 2 ? -1.0f : 1.0f,
                   front ? 1.0f : -1.0f};
  }
}

// Decodes Gaussians from unpacked data, also during the unpacking, which uses one thread.
class Decoder {
 public:
  Decoder(const SpzData& data, GaussianModel& model) : data_(data), model_(model) {}
  ~Decoder() { stop_ = true; }  // beside_ waits for its thread

  // The first `bytes` of the data are complete and will not move. Another thread decodes the
  // Gaussians in them, unless it is still busy with an earlier offer.
  void Offer(size_t bytes) {
    if (beside_.valid()) {
      if (beside_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return;
      beside_.get();
    }
    beside_ = std::async(std::launch::async, [this, bytes] { DecodeBeside(bytes); });
  }

  // Decodes the rest of the complete data on all cores.
  void Finish(Monitor& monitor) {
    stop_ = true;
    if (beside_.valid()) beside_.get();
    Resize();
    for (size_t s = 0; s < done_.size(); ++s) {
      const size_t before = done_[s], left = model_.NumGaussians() - before;
      const double rows = static_cast<double>(model_.NumGaussians());
      const auto report = [&](size_t more) {
        const double sections = static_cast<double>(s) + static_cast<double>(before + more) / rows;
        monitor.Step("load", 1 + sections / static_cast<double>(done_.size()), 2);
      };
      ForRows(left, report, [&](size_t begin, size_t end) {
        DecodeSpzSection(data_, SpzData::Section(s), before + begin, before + end, model_);
      });
    }
  }

 private:
  void Resize() {
    if (model_.NumGaussians() > 0) return;
    model_.Resize(data_.header.count, std::min<int>(data_.header.sh_degree, 3));
  }

  void DecodeBeside(size_t bytes) {
    constexpr size_t kRows = 4096;
    Resize();
    for (size_t s = 0; s < done_.size(); ++s) {
      const size_t width = data_.Widths()[s], at = data_.SectionAt(s);
      if (width == 0 || bytes < at) return;
      const size_t whole = std::min(model_.NumGaussians(), (bytes - at) / width);
      while (done_[s] < whole && !stop_) {
        const size_t end = std::min(done_[s] + kRows, whole);
        DecodeSpzSection(data_, SpzData::Section(s), done_[s], end, model_);
        done_[s] = end;
      }
    }
  }

  const SpzData& data_;
  GaussianModel& model_;
  std::array<size_t, SpzData::kSections> done_{};  // decoded Gaussians of each section
  std::atomic<bool> stop_ = false;
  std::future<void> beside_;
};

// Lets the decoder start after a quarter of the data: by then, the file is more than a header that
// announces a lot.
void Unpack(const std::string& file, const std::filesystem::path& path, Monitor& monitor,
            SpzData& packed, Decoder& decoder) {
  const auto load_header = [&](std::string_view from) {
    if (from.size() < kSpzHeaderBytes) throw InputError(path, "truncated: the header is not whole");
    std::memcpy(&packed.header, from.data(), kSpzHeaderBytes);
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
    Gunzip(
        file, kSpzHeaderBytes,
        [&](std::string_view head) {
          load_header(head);
          CheckHeader(packed.header, 1, 3, file.size(), path);
          return most();
        },
        [&](size_t done) {
          monitor.Step("load", 0.5 * static_cast<double>(done), static_cast<double>(most()));
          // Extensions come last, and may name other axes.
          const bool axes_known = (packed.header.flags & kHasExtensions) == 0;
          if (axes_known && done >= packed.Size() / 4 && most() < kUsualRatio * file.size()) {
            decoder.Offer(done);
          }
        },
        packed.bytes);
  }
  if (packed.bytes.size() < packed.Size()) {
    throw InputError(path, "truncated: the header announces " +
                               std::to_string(packed.header.count) + " Gaussians, " +
                               std::to_string(packed.bytes.size() - kSpzHeaderBytes) +
                               " bytes follow it");
  }
  if (packed.header.flags & kHasExtensions) {
    ReadExtensions(packed, path);
  } else if (packed.bytes.size() > packed.Size()) {
    throw InputError(path, std::to_string(packed.bytes.size() - packed.Size()) +
                               " bytes follow the last value: the file is damaged");
  }
}

// ---- Writing

int FileDegree(const GaussianModel& model) { return HasShBand4(model) ? 4 : model.sh_degree; }

// Loads the data of the model's source. False unless the model's values can be written over it.
bool LoadSource(const GaussianModel& model, SpzData& packed) {
  const SourceLayout& source = model.source;
  if (source.packed_format != kMark || source.packed.size() < kSpzHeaderBytes) return false;
  std::memcpy(&packed.header, source.packed.data(), kSpzHeaderBytes);
  if (packed.header.version < 2 || packed.header.count != model.NumGaussians() ||
      packed.header.sh_degree != FileDegree(model) || source.packed.size() < packed.Size()) {
    return false;
  }
  packed.bytes = source.packed;
  if (packed.header.flags & kHasExtensions) ReadExtensions(packed, "source");
  return true;
}

SpzData NewFile(const GaussianModel& model) {
  SpzData packed;
  packed.header.count = static_cast<uint32_t>(model.NumGaussians());
  packed.header.sh_degree = static_cast<uint8_t>(FileDegree(model));
  if (packed.header.sh_degree == 4) {  // earlier versions do not have it
    packed.header.version = 4;
    packed.header.streams = 6;
  }
  double farthest = 0;
  for (const float x : model.means) farthest = std::max(farthest, std::abs(double{x}));
  int bits = kMostFractionalBits;
  while (bits > 0 && std::ldexp(farthest, bits) > kSpzFixedMost) --bits;
  packed.header.fractional_bits = static_cast<uint8_t>(bits);
  packed.bytes.assign(packed.Size(), '\0');
  std::memcpy(packed.bytes.data(), &packed.header, kSpzHeaderBytes);
  return packed;
}

void WriteVersion4(SpzData& packed, Monitor& monitor, AtomicFile& file) {
  const size_t streams = packed.header.streams;
  const auto extensions = packed.bytes.begin() + static_cast<std::ptrdiff_t>(packed.Size());
  file.Write(&packed.header, kSpzHeaderBytes);
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
  // A truncated file may show only a part of the magic number, or nothing.
  const std::vector<char> start = GunzipHead(head, kMagic.size());
  return kMagic.starts_with(std::string_view(start.data(), start.size()));
}

GaussianModel SpzCodec::Read(const std::filesystem::path& path, Monitor& monitor,
                             BadRows bad) const {
  monitor.Step("load", 0, 1);
  const std::string file = ReadFile(path);
  GaussianModel model;
  SpzData packed;
  Decoder decoder(packed, model);
  NamingPath(path, [&] { Unpack(file, path, monitor, packed, decoder); });
  decoder.Finish(monitor);
  if (packed.header.sh_degree > 3) {
    ShBand4Columns::AddTo(model);
    ShBand4Columns band4(model);
    ForRows(
        model.NumGaussians(), [&](size_t) { monitor.ThrowIfCancelled(); },
        [&](size_t begin, size_t end) {
          for (size_t g = begin; g < end; ++g) band4.Set(g, DecodeSpzBand4(packed, g));
        });
  }
  ValidateRead(model, path, bad);
  if (packed.header.flags & kAntialiased) {
    model.traits.render_model = RenderModel::kMip;
    model.traits.render_model_reason = "the flag of antialiased splats";
  }
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
  SpzData packed;
  const bool patch = LoadSource(model, packed);
  if (!patch) packed = NewFile(model);
  const bool is_mip = model.traits.render_model == RenderModel::kMip;
  packed.header.flags = static_cast<uint8_t>((packed.header.flags & ~kAntialiased) | is_mip);
  std::memcpy(packed.bytes.data(), &packed.header, kSpzHeaderBytes);
  const size_t count = packed.header.count;
  GaussianModel columns;  // only those of degree 4
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
    if (patch) was = DecodeSpzRow(packed, g);
    if (!EncodeSpzRow(packed, g, GetRow(model, g), patch ? &was : nullptr)) {
      throw RunError(path.string() + ": not written: Gaussian " + std::to_string(g) +
                     ": mean is beyond the range of the .spz's positions");
    }
    if (!band4.present()) continue;
    ShBand4 old;
    if (patch) old = DecodeSpzBand4(packed, g);
    EncodeSpzBand4(packed, g, band4.Get(g), patch ? &old : nullptr);
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
  std::vector<std::string> losses = CommonLosses(model, 4, Name(), std::array{RenderModel::kMip});
  const auto clamped = [&](std::span<const float> values, size_t width, float least, float most) {
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
