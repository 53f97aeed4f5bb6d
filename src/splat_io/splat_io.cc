// SPDX-License-Identifier: BSD-3-Clause
#include "splat_io/splat_io.h"

#include <algorithm>
#include <array>
#include <cctype>

#include "base/error.h"
#include "splat_io/compressed_ply_codec.h"
#include "splat_io/gltf_codec.h"
#include "splat_io/input_file.h"
#include "splat_io/ksplat_codec.h"
#include "splat_io/ply_codec.h"
#include "splat_io/sog_codec.h"
#include "splat_io/splat_codec.h"
#include "splat_io/spz_codec.h"

namespace retint {
namespace {

// Formats that are recognized in order to name them, not read.
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
  return lower_name.size() > extension.size() && lower_name.ends_with(extension);
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

std::string SupportedFormats(bool writable) {
  std::string names;
  for (const SplatCodec* codec : SplatCodecs()) {
    if (writable && !codec->CanWrite()) continue;
    names += (names.empty() ? "" : ", ") + std::string(codec->Name());
  }
  return "supported: " + names;
}

}  // namespace

void SplatCodec::Write(const std::filesystem::path& path, const GaussianModel&, Monitor&) const {
  throw OptionError(path.string() + ": cannot write " + std::string(Name()));
}

std::span<const SplatCodec* const> SplatCodecs() {
  // A codec whose signature or extension includes another's stands before it.
  static const CompressedPlyCodec compressed_ply;
  static const PlyCodec ply;
  static const DotSplatCodec splat;
  static const SpzCodec spz;
  static const KsplatCodec ksplat;
  static const SogCodec sog;
  static const GltfCodec gltf;
  static const auto codecs =
      std::to_array<const SplatCodec*>({&compressed_ply, &ply, &splat, &spz, &ksplat, &sog, &gltf});
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

GaussianModel ReadSplat(const std::filesystem::path& path, Monitor& monitor) {
  std::string head;
  {
    const InputFile file(path);
    if (file.size() == 0) throw InputError(path, "empty file");
    head.resize(std::min<uint64_t>(file.size(), kSniffBytes));
    file.ReadAt(0, head.data(), head.size());
  }
  if (const SplatCodec* codec = FindCodec(path, head)) return codec->Read(path, monitor);
  const KnownFormat* format = Unsupported(LowerName(path), head);
  throw InputError(path, (format ? "this is " + std::string(format->name) + ", not supported"
                                 : std::string("not a known splat format")) +
                             "; " + SupportedFormats(/*writable=*/false));
}

GaussianModel ReadSplat(const std::filesystem::path& path) {
  Monitor monitor;
  return ReadSplat(path, monitor);
}

void WriteSplat(const std::filesystem::path& path, const GaussianModel& model, Monitor& monitor) {
  CodecForWriting(path).Write(path, model, monitor);
}

void WriteSplat(const std::filesystem::path& path, const GaussianModel& model) {
  Monitor monitor;
  WriteSplat(path, model, monitor);
}

}  // namespace retint
