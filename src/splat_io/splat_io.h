// SPDX-License-Identifier: BSD-3-Clause
// Splat files <-> GaussianModel, with a codec for each format behind one registry
// (docs/formats.md). Unedited values are written back bit for bit if source and target have the
// same format.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/monitor.h"
#include "scene/gaussian_model.h"

namespace retint {

// How to treat Gaussians with NaN or infinite values: reject the file, or drop them. Codecs leave
// them in place, and ReadSplat() drops them.
enum class BadRows { kRefuse, kDrop };

class SplatCodec {
 public:
  virtual ~SplatCodec() = default;
  virtual std::string_view Name() const = 0;                         // "3DGS .ply"
  virtual std::span<const std::string_view> Extensions() const = 0;  // lower case: ".ply"
  // Whether a file whose first kSniffBytes are `head` (fewer if it is shorter) has this format.
  // Always false for a format without a signature: its files are recognized by extension.
  virtual bool Sniff(std::string_view head) const = 0;
  // InputError with `path` and the fault. The result passes GaussianModel::Validate(). Reports the
  // stage "load"; can be cancelled between blocks of rows.
  virtual GaussianModel Read(const std::filesystem::path& path, Monitor& monitor,
                             BadRows bad = BadRows::kRefuse) const = 0;

  // All files of the splat at `path`; InputError if `path` does not say which.
  virtual std::vector<std::filesystem::path> Files(const std::filesystem::path& path) const {
    return {path};
  }

  virtual bool CanWrite() const { return true; }
  // Atomic: on any error (RunError) or cancellation, an existing file stays unchanged. Reports the
  // stage "save". Codecs without CanWrite() do not override it.
  virtual void Write(const std::filesystem::path& path, const GaussianModel& model,
                     Monitor& monitor) const;
  // Whether it stores values with less precision than floats.
  virtual bool Rounds() const { return false; }
  // One sentence for the user about each part of `model` that the format cannot hold. Not about
  // rounding, which `retint convert` measures.
  virtual std::vector<std::string> Losses(const GaussianModel&) const { return {}; }
  // The order in which Write() stores the Gaussians; empty: the model's order.
  virtual std::vector<uint32_t> WriteOrder(const GaussianModel&) const { return {}; }
};

inline constexpr size_t kSniffBytes = 4096;

// All codecs, in the order of Sniff() calls.
std::span<const SplatCodec* const> SplatCodecs();

// The codec for a file that starts with `head`: by signature, otherwise by extension. nullptr if
// there is none, or if the signature is of a known unsupported format.
const SplatCodec* FindCodec(const std::filesystem::path& path, std::string_view head);

// The codec that writes `path`, by its extension. OptionError if there is none: call this before
// long work whose result goes to `path`.
const SplatCodec& CodecForWriting(const std::filesystem::path& path);

// For file dialogs: all formats, in the order of the registry.
struct SplatFormat {
  std::string_view name;                     // "3DGS .ply"
  std::vector<std::string_view> extensions;  // ".ply"
  bool writable = false;                     // all can be read
};
std::vector<SplatFormat> SplatFormats();

// Reads a splat file of any supported format. InputError for a missing, unsupported (with the name
// of its format), truncated or damaged file, or one without Gaussians. With BadRows::kDrop,
// source.notes says how many were dropped.
GaussianModel ReadSplat(const std::filesystem::path& path, Monitor& monitor,
                        BadRows bad = BadRows::kRefuse);
GaussianModel ReadSplat(const std::filesystem::path& path);

// All files of the splat at `path`, each once: with the pictures of a SOG folder, and the buffers
// beside a .gltf. InputError as ReadSplat(), for the parts that list files.
std::vector<std::filesystem::path> SplatFiles(const std::filesystem::path& path);
// The total size of SplatFiles().
uint64_t SplatBytes(const std::filesystem::path& path);

// Writes in the format of the extension. OptionError as CodecForWriting(). RunError for an invalid
// model (empty, NaN, arrays that disagree) or a failed write. Never leaves a partial file.
void WriteSplat(const std::filesystem::path& path, const GaussianModel& model, Monitor& monitor);
void WriteSplat(const std::filesystem::path& path, const GaussianModel& model);

}  // namespace retint
