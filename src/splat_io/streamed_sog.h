// SPDX-License-Identifier: BSD-3-Clause
// PlayCanvas's streamed SOG version 1 (developer.playcanvas.com, "The Streamed SOG Format"): a
// scene in several levels of detail, cut into SOG scenes ("chunks") that a viewer loads one by one.
#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include "splat_io/splat_io.h"

namespace retint {

// lod-meta.json names the chunks, each of one level, and has a tree of boxes whose leaves are runs
// of Gaussians of chunks; an optional "environment" is shown with every level. Level 0 is the
// finest. Positions are in the .ply's frame.
// Read() gives level 0 and then the environment, chunks in the order of "filenames". InputError for
// names that lead out of the folder, and for runs that do not make up their chunks.
// It is written only with the Gaussians that were read, into another folder: chunks in which a
// color changed get new sh0 and shN, all other files are copies.
class StreamedSogCodec : public SplatCodec {
 public:
  std::string_view Name() const override { return "streamed SOG (lod-meta.json)"; }
  std::span<const std::string_view> Extensions() const override;
  bool Sniff(std::string_view head) const override;
  GaussianModel Read(const std::filesystem::path& path, Monitor& monitor,
                     BadRows bad = BadRows::kRefuse) const override;
  std::vector<std::filesystem::path> Files(const std::filesystem::path& path) const override;
  // WriteStreamedSog() with the finest level: OptionError if others would have other colors.
  void Write(const std::filesystem::path& path, const GaussianModel& model,
             Monitor& monitor) const override;
  bool Rounds() const override { return true; }
};

// Whether a splat was read from a streamed SOG, and whether a file would be one by its name.
bool IsStreamedSog(const GaussianModel& model);
bool IsStreamedSog(const std::filesystem::path& path);

// Before long work: OptionError if `path` would be a streamed SOG and WriteStreamedSog() would
// refuse a splat that came from where `model` does.
void CheckStreamedSog(const std::filesystem::path& path, const GaussianModel& model);

// The number of levels of a splat that was read from a streamed SOG, 1 or more, and another level,
// 1 to that less one, again with the environment. InputError as ReadSplat().
int NumStreamedLevels(const GaussianModel& finest);
GaussianModel ReadStreamedLevel(const GaussianModel& finest, int level, Monitor& monitor);

// `levels`: the splat that was read, and the other levels, with new colors. Without new colors the
// finest suffices. All files are put in place together, lod-meta.json last. OptionError if
// Gaussians are not those that were read, or for the folder that they were read from.
void WriteStreamedSog(const std::filesystem::path& path, std::span<const GaussianModel> levels,
                      Monitor& monitor);

}  // namespace retint
