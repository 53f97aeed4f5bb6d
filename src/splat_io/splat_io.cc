// SPDX-License-Identifier: BSD-3-Clause
#include "splat_io/splat_io.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <utility>

#include "base/error.h"
#include "base/finite.h"
#include "base/input_file.h"
#include "base/input_guard.h"
#include "splat_io/compressed_ply_codec.h"
#include "splat_io/gltf_codec.h"
#include "splat_io/ksplat_codec.h"
#include "splat_io/ply_codec.h"
#include "splat_io/sog_codec.h"
#include "splat_io/splat_codec.h"
#include "splat_io/spz_codec.h"
#include "splat_io/streamed_sog.h"
#include "splat_io/usd_codec.h"

namespace retint {
namespace {

// Formats without a codec, recognized for a better message.
struct KnownFormat {
  std::string_view signature;  // first bytes
  std::string_view extension;  // empty: any
  std::string_view name;
};

constexpr KnownFormat kUnsupported[] = {
    {"\x1f\x8b", "", "a gzip file"},
    {"PK\x03\x04", ".pth", "a PyTorch checkpoint"},
    {"PK\x03\x04", ".pt", "a PyTorch checkpoint"},
    {"PK\x03\x04", ".ckpt", "a PyTorch checkpoint"},
    {"PK\x03\x04", "", "a zip archive"},
};

std::string LowerName(const std::filesystem::path& path) {
  std::string name = path.filename().string();
  std::transform(name.begin(), name.end(), name.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return name;
}

bool HasExtension(const std::string& lower_name, std::string_view extension) {
  // ".ply" needs a name before the dot. "meta.json" is a complete name.
  return lower_name.ends_with(extension) &&
         (extension[0] != '.' ? lower_name.size() == extension.size()
                              : lower_name.size() > extension.size());
}

const KnownFormat* Unsupported(const std::string& lower_name, std::string_view head) {
  for (const KnownFormat& format : kUnsupported) {
    if (head.starts_with(format.signature) &&
        (format.extension.empty() || HasExtension(lower_name, format.extension))) {
      return &format;
    }
  }
  return nullptr;
}

const SplatCodec* CodecByExtension(const std::string& lower_name) {
  for (const SplatCodec* codec : SplatCodecs()) {
    for (const std::string_view extension : codec->Extensions()) {
      if (HasExtension(lower_name, extension)) return codec;
    }
  }
  return nullptr;
}

// Keeps only the rows `keep` of `values`, `width` values each.
template <typename Values>
void KeepRows(Values& values, size_t width, const std::vector<size_t>& keep) {
  Values kept;
  kept.reserve(keep.size() * width);
  for (const size_t g : keep) {
    const auto row = values.begin() + static_cast<std::ptrdiff_t>(g * width);
    kept.insert(kept.end(), row, row + static_cast<std::ptrdiff_t>(width));
  }
  values = std::move(kept);
}

void DropBadRows(GaussianModel& model, const std::filesystem::path& path) {
  const size_t count = model.NumGaussians();
  const size_t sh_width = static_cast<size_t>(model.NumShCoeffs()) * 3;
  const std::pair<FloatArray*, size_t> arrays[] = {{&model.means, 3},
                                                   {&model.quats_wxyz, 4},
                                                   {&model.log_scales, 3},
                                                   {&model.opacity_logits, 1},
                                                   {&model.sh, sh_width}};
  std::vector<size_t> keep;
  for (size_t g = 0; g < count; ++g) {
    const bool good = std::all_of(std::begin(arrays), std::end(arrays), [&](const auto& array) {
      const auto& [values, width] = array;
      return AllFinite(std::span(*values).subspan(g * width, width));
    });
    if (good) keep.push_back(g);
  }
  if (keep.size() == count) return;
  if (keep.empty()) throw InputError(path, "every Gaussian has a value that is NaN or infinite");
  for (const auto& [values, width] : arrays) KeepRows(*values, width, keep);
  for (ExtraColumn& extra : model.source.extras) {
    KeepRows(extra.bytes, static_cast<size_t>(extra.bytes_per_value), keep);
  }
  model.source.packed_format.clear();  // it holds all rows
  model.source.packed.clear();
  model.source.notes.push_back(std::to_string(count - keep.size()) +
                               " Gaussians with a value that is NaN or infinite were left out");
}

std::string SupportedFormats(bool writable) {
  std::string names;
  for (const SplatCodec* codec : SplatCodecs()) {
    if (writable && !codec->CanWrite()) continue;
    names += (names.empty() ? "" : ", ") + std::string(codec->Name());
  }
  return "supported: " + names;
}

// The codec of the file at `path`; InputError if there is none.
const SplatCodec& CodecForReading(const std::filesystem::path& path) {
  const InputFile file(path);
  if (file.size() == 0) throw InputError(path, "empty file");
  std::string head(std::min<uint64_t>(file.size(), kSniffBytes), '\0');
  file.ReadAt(0, head.data(), head.size());
  if (const SplatCodec* codec = FindCodec(path, head)) return *codec;
  const KnownFormat* format = Unsupported(LowerName(path), head);
  throw InputError(path, (format ? "this is " + std::string(format->name) + ", not supported"
                                 : std::string("not a known splat format")) +
                             "; " + SupportedFormats(/*writable=*/false));
}

}  // namespace

void SplatCodec::Write(const std::filesystem::path& path, const GaussianModel&, Monitor&) const {
  throw OptionError(path.string() + ": cannot write " + std::string(Name()));
}

std::span<const SplatCodec* const> SplatCodecs() {
  // If a signature or extension includes another's, its codec comes first.
  static const CompressedPlyCodec compressed_ply;
  static const PlyCodec ply;
  static const DotSplatCodec splat;
  static const SpzCodec spz;
  static const KsplatCodec ksplat;
  static const SogCodec sog;
  static const StreamedSogCodec streamed_sog;
  static const GltfCodec gltf;
  static const UsdCodec usd;
  static const auto codecs = std::to_array<const SplatCodec*>(
      {&compressed_ply, &ply, &splat, &spz, &ksplat, &sog, &streamed_sog, &gltf, &usd});
  return codecs;
}

std::vector<SplatFormat> SplatFormats() {
  std::vector<SplatFormat> formats;
  for (const SplatCodec* codec : SplatCodecs()) {
    const auto extensions = codec->Extensions();
    formats.push_back({codec->Name(), {extensions.begin(), extensions.end()}, codec->CanWrite()});
  }
  return formats;
}

const SplatCodec* FindCodec(const std::filesystem::path& path, std::string_view head) {
  for (const SplatCodec* codec : SplatCodecs()) {
    if (codec->Sniff(head)) return codec;
  }
  const std::string name = LowerName(path);
  return Unsupported(name, head) ? nullptr : CodecByExtension(name);
}

const SplatCodec& CodecForWriting(const std::filesystem::path& path) {
  const SplatCodec* codec = CodecByExtension(LowerName(path));
  if (codec && codec->CanWrite()) return *codec;
  throw OptionError(path.string() + ": cannot write " +
                    (codec ? std::string(codec->Name()) : "a splat of this extension") + "; " +
                    SupportedFormats(/*writable=*/true));
}

GaussianModel ReadSplat(const std::filesystem::path& path, Monitor& monitor, BadRows bad) {
  const ReadAhead ahead(path);
  GaussianModel model = CodecForReading(path).Read(path, monitor, bad);
  if (bad == BadRows::kDrop) DropBadRows(model, path);
  monitor.Step("load", 1, 1);  // codecs report before each block, not at the end
  return model;
}

GaussianModel ReadSplat(const std::filesystem::path& path) {
  Monitor monitor;
  return ReadSplat(path, monitor);
}

std::vector<std::filesystem::path> SplatFiles(const std::filesystem::path& path) {
  std::vector<std::filesystem::path> files = CodecForReading(path).Files(path);
  // A file may have several uses.
  std::sort(files.begin(), files.end());
  files.erase(std::unique(files.begin(), files.end()), files.end());
  return files;
}

uint64_t SplatBytes(const std::filesystem::path& path) {
  uint64_t bytes = 0;
  for (const std::filesystem::path& file : SplatFiles(path)) bytes += InputFile(file).size();
  return bytes;
}

void WriteSplat(const std::filesystem::path& path, const GaussianModel& model, Monitor& monitor) {
  const SplatCodec& codec = CodecForWriting(path);
  InputGuard replaced;
  replaced.AllowSplat(path);
  codec.Write(path, model, monitor);
  monitor.Step("save", 1, 1);  // as above
}

void WriteSplat(const std::filesystem::path& path, const GaussianModel& model) {
  Monitor monitor;
  WriteSplat(path, model, monitor);
}

}  // namespace retint
