// SPDX-License-Identifier: BSD-3-Clause
#include "splat_io/splat_io.h"

#include <algorithm>
#include <array>
#include <cctype>

#include "base/error.h"
#include "splat_io/input_file.h"
#include "splat_io/ply_codec.h"

namespace retint {
namespace {

// Formats that are recognised in order to name them, not read.
struct KnownFormat {
  std::string_view signature;  // first bytes; empty: none
  std::string_view extension;  // empty: any. With a signature, both must match.
  std::string_view name;
};

constexpr KnownFormat kUnsupported[] = {
    {"NGSP", "", "SPZ"},
    {"\x1f\x8b", ".spz", "SPZ (gzip)"},
    {"\x1f\x8b", "", "a gzip file (SPZ looks like this)"},
    {"PK\x03\x04", ".sog", "SOG"},
    {"PK\x03\x04", ".pth", "a PyTorch checkpoint"},
    {"PK\x03\x04", ".pt", "a PyTorch checkpoint"},
    {"PK\x03\x04", ".ckpt", "a PyTorch checkpoint"},
    {"PK\x03\x04", "", "a zip archive (SOG looks like this)"},
    {"glTF", "", "binary glTF"},
    {"", ".splat", ".splat (antimatter15)"},
    {"", ".ksplat", ".ksplat (GaussianSplats3D)"},
    {"", ".spz", "SPZ"},
    {"", ".sog", "SOG"},
    {"", ".compressed.ply", "compressed .ply (PlayCanvas)"},
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

const KnownFormat* UnsupportedBySignature(const std::string& lower_name, std::string_view head) {
  for (const KnownFormat& format : kUnsupported) {
    if (!format.signature.empty() && head.starts_with(format.signature) &&
        (format.extension.empty() || HasExtension(lower_name, format.extension))) {
      return &format;
    }
  }
  return nullptr;
}

const KnownFormat* UnsupportedByExtension(const std::string& lower_name) {
  for (const KnownFormat& format : kUnsupported) {
    if (format.signature.empty() && HasExtension(lower_name, format.extension)) return &format;
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

std::string SupportedFormats() {
  std::string names;
  for (const SplatCodec* codec : SplatCodecs()) {
    names += (names.empty() ? "" : ", ") + std::string(codec->Name());
  }
  return "supported: " + names;
}

}  // namespace

std::span<const SplatCodec* const> SplatCodecs() {
  static const PlyCodec ply;
  static const std::array<const SplatCodec*, 1> codecs = {&ply};
  return codecs;
}

const SplatCodec* FindCodec(const std::filesystem::path& path, std::string_view head) {
  for (const SplatCodec* codec : SplatCodecs()) {
    if (codec->Sniff(head)) return codec;
  }
  const std::string name = LowerName(path);
  if (UnsupportedBySignature(name, head) || UnsupportedByExtension(name)) return nullptr;
  return CodecByExtension(name);
}

const SplatCodec& CodecForWriting(const std::filesystem::path& path) {
  const std::string name = LowerName(path);
  const KnownFormat* unsupported = UnsupportedByExtension(name);
  const SplatCodec* codec = unsupported ? nullptr : CodecByExtension(name);
  if (codec) return *codec;
  throw OptionError(path.string() + ": cannot write " +
                    (unsupported ? std::string(unsupported->name) : "a splat of this extension") +
                    "; " + SupportedFormats());
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
  const std::string name = LowerName(path);
  const KnownFormat* format = UnsupportedBySignature(name, head);
  if (!format) format = UnsupportedByExtension(name);
  throw InputError(path, (format ? "this is " + std::string(format->name) + ", not supported"
                                 : std::string("not a known splat format")) +
                             "; " + SupportedFormats());
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
