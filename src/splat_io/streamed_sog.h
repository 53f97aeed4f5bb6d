// SPDX-License-Identifier: BSD-3-Clause
// Version 1 of PlayCanvas's streamed SOG (developer.playcanvas.com, "The Streamed SOG Format"): a
// scene in several levels of detail, cut into SOG scenes ("chunks") that viewers load one by one.
#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include "splat_io/splat_io.h"

namespace retint {

// lod-meta.json lists the chunks, each of one level, and has a tree of boxes. Its leaves are
// runs of Gaussians in chunks. An optional "environment" belongs to every level. Level 0 is
// the finest. Positions are in the .ply's frame. Read() returns level 0, then the
// environment, with chunks in the order of "filenames". InputError for names outside the
// folder, and if runs do not fill their chunks. Only the Gaussians that were read can be
// written, and only to another folder. Chunks with changed colors get new sh0 and shN; all
// other files are copies.
class StreamedSogCodec : public SplatCodec {
 public:
  std::string_view Name() const override { return "streamed SOG (lod-meta.json)"; }
  std::span<const std::string_view> Extensions() const override;
  bool Sniff(std::string_view head) const override;
  GaussianModel Read(const std::filesystem::path& path, Monitor& monitor,
                     BadRows bad = BadRows::kRefuse) const override;
  std::vector<std::filesystem::path> Files(const std::filesystem::path& path) const override;
  // WriteStreamedSog() with the finest level: OptionError if the other levels need new colors too.
  void Write(const std::filesystem::path& path, const GaussianModel& model,
             Monitor& monitor) const override;
  bool Rounds() const override { return true; }
};

// Whether a splat was read from a streamed SOG; whether the name of a file is that of one.
bool IsStreamedSog(const GaussianModel& model);
bool IsStreamedSog(const std::filesystem::path& path);

// Call it before long work. OptionError if `path` names a streamed SOG, and WriteStreamedSog()
// would reject a splat that was read as `model` was.
void CheckStreamedSog(const std::filesystem::path& path, const GaussianModel& model);

// The number of levels, at least 1, of a splat that was read from a streamed SOG. Reads another
// level, from 1 on, with the environment. InputError as ReadSplat().
int NumStreamedLevels(const GaussianModel& finest);
GaussianModel ReadStreamedLevel(const GaussianModel& finest, int level, Monitor& monitor);

// `levels`: the finest level as it was read and then all others, with new colors. Without new
// colors, the finest is enough. Puts all files in place together, lod-meta.json last. OptionError
// if these are not the Gaussians that were read, or for the folder that they came from.
void WriteStreamedSog(const std::filesystem::path& path, std::span<const GaussianModel> levels,
                      Monitor& monitor);

}  // namespace retint
