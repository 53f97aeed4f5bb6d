// SPDX-License-Identifier: BSD-3-Clause
// SOG version 2 of PlayCanvas (developer.playcanvas.com, "The SOG Format"), as a zip bundle or a
// folder of files.
#pragma once

#include "splat_io/splat_io.h"

namespace retint {

// meta.json and lossless WebP pictures with one pixel a Gaussian. Positions, as sign(x) ln(1 +
// |x|), have 16 bits between bounds. The three smaller components of a quaternion have 8 bits each,
// opacities 8 bits. Log scales and SH degree 0 are indices into tables of 256 values, higher SH an
// index into a palette of at most 65,536 sets. The frame is that of the .ply. A folder is named by
// its meta.json, which is written last.
// Rounding: positions 1/65535 of the extent of their logarithms, rotations 1/180, opacities 1/510;
// scales, colors and higher bands to the tables that fit best (sog_tables.h). Written over a scene
// that came from a SOG, unedited values keep theirs. New colors use free entries of the tables; if
// one is more than 1/255 off, the tables are made anew.
class SogCodec : public SplatCodec {
 public:
  std::string_view Name() const override { return "SOG (.sog or meta.json)"; }
  std::span<const std::string_view> Extensions() const override;
  bool Sniff(std::string_view head) const override;
  GaussianModel Read(const std::filesystem::path& path, Monitor& monitor,
                     BadRows bad = BadRows::kRefuse) const override;
  std::vector<std::filesystem::path> Files(const std::filesystem::path& path) const override;
  void Write(const std::filesystem::path& path, const GaussianModel& model,
             Monitor& monitor) const override;
  bool Rounds() const override { return true; }
  std::vector<std::string> Losses(const GaussianModel& model) const override;
  std::vector<uint32_t> WriteOrder(const GaussianModel& model) const override;
};

}  // namespace retint
