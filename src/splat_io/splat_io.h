// SPDX-License-Identifier: BSD-3-Clause
// Splat files <-> GaussianModel, a codec per format behind one registry (docs/formats.md).
// Values that were not edited are written back bit for bit if source and target have the same
// format.
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

// The treatment of Gaussians with a value that is NaN or infinite: the file is refused, or codecs
// leave them as they are and ReadSplat() leaves them out.
enum class BadRows { kRefuse, kDrop };

class SplatCodec {
 public:
  virtual ~SplatCodec() = default;
  virtual std::string_view Name() const = 0;                         // "3DGS .ply"
  virtual std::span<const std::string_view> Extensions() const = 0;  // lower case: ".ply"
  // Whether `head`, the first kSniffBytes of a file (fewer when it is shorter), is of this format.
  // Always false for a format without a signature: its files are then known by their extension.
  virtual bool Sniff(std::string_view head) const = 0;
  // InputError naming `path` and the fault. The result passes GaussianModel::Validate(). Reports
  // the stage "load"; may be cancelled between blocks of rows.
  virtual GaussianModel Read(const std::filesystem::path& path, Monitor& monitor,
                             BadRows bad = BadRows::kRefuse) const = 0;

  // All files that the splat at `path` is made of; InputError where `path` does not tell.
  virtual std::vector<std::filesystem::path> Files(const std::filesystem::path& path) const {
    return {path};
  }

  virtual bool CanWrite() const { return true; }
  // Atomic: on any error (RunError), and when cancelled, a file that was there stays as it was.
  // Reports the stage "save". A codec that only reads says so in CanWrite() and leaves it out.
  virtual void Write(const std::filesystem::path& path, const GaussianModel& model,
                     Monitor& monitor) const;
  // Whether it stores values with less precision than floats.
  virtual bool Rounds() const { return false; }
  // What of `model` the format has no place for; one sentence each, for the user. Rounding is not
  // listed: `retint convert` measures it.
  virtual std::vector<std::string> Losses(const GaussianModel&) const { return {}; }
  // The Gaussians in the order in which Write() puts them; empty where it keeps the model's.
  virtual std::vector<uint32_t> WriteOrder(const GaussianModel&) const { return {}; }
};

inline constexpr size_t kSniffBytes = 4096;

// All codecs, in the order in which they are asked.
std::span<const SplatCodec* const> SplatCodecs();

// The codec for a file whose first bytes are `head`: by signature, else by extension. nullptr when
// there is none, or when the signature is of a format known to be unsupported.
const SplatCodec* FindCodec(const std::filesystem::path& path, std::string_view head);

// The codec that writes `path`, by its extension. OptionError when there is none: call it before
// long work whose result goes there.
const SplatCodec& CodecForWriting(const std::filesystem::path& path);

// For file dialogs: the formats that can be read and written, in the order of the registry.
struct SplatFormat {
  std::string_view name;                     // "3DGS .ply"
  std::vector<std::string_view> extensions;  // ".ply"
  bool writable = false;                     // every one is readable
};
std::vector<SplatFormat> SplatFormats();

// Reads a splat file of any supported format. InputError for a missing, unsupported (the format
// found is named), truncated or damaged file, or one without Gaussians.
// With BadRows::kDrop how many were left out is one of source.notes.
GaussianModel ReadSplat(const std::filesystem::path& path, Monitor& monitor,
                        BadRows bad = BadRows::kRefuse);
GaussianModel ReadSplat(const std::filesystem::path& path);

// All files that the splat at `path` is made of, each once: of a SOG folder its pictures too, of a
// .gltf the buffers beside it. InputError as ReadSplat, as far as they need to be known.
std::vector<std::filesystem::path> SplatFiles(const std::filesystem::path& path);
// Their size.
uint64_t SplatBytes(const std::filesystem::path& path);

// Writes in the format of the extension. OptionError as CodecForWriting, RunError for a model that
// cannot be written (empty, NaN, arrays that disagree) or a failed write; never a partial file.
void WriteSplat(const std::filesystem::path& path, const GaussianModel& model, Monitor& monitor);
void WriteSplat(const std::filesystem::path& path, const GaussianModel& model);

}  // namespace retint
