// SPDX-License-Identifier: BSD-3-Clause
// PlayCanvas's SOG version 2 (developer.playcanvas.com, "The SOG Format"), a zip bundle or a
// folder.
#pragma once

#include "splat_io/splat_io.h"

namespace retint {

// meta.json and lossless WebP pictures of a pixel a Gaussian: positions in 16 bits between bounds,
// of sign(x) ln(1 + |x|); quaternions of which the three smaller components have 8 bits; log scales
// and SH degree 0 as indices into tables of 256 values; opacities in 8 bits; higher SH as an index
// into a palette of at most 65,536 sets. The frame is the .ply's.
// A folder is read and written by its meta.json, which is put in place last. Rounding: positions
// 1/65535 of their extent as logarithms, rotations 1/180, opacities 1/510; scales, colors and
// higher bands to the tables that fit them best (sog_tables.h). Written over a scene that came from
// a SOG, values that were not edited keep theirs; where a new color lies further than a step of 255
// from what the tables hold beside that, tables are made anew.
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
