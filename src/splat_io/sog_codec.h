// SPDX-License-Identifier: BSD-3-Clause
// PlayCanvas's SOG version 2 (developer.playcanvas.com, "The SOG Format"), a zip bundle or a
// folder; only read.
#pragma once

#include "splat_io/splat_io.h"

namespace retint {

// meta.json and lossless WebP pictures of a pixel a Gaussian: positions in 16 bits between bounds,
// of sign(x) ln(1 + |x|); quaternions of which the three smaller components have 8 bits; log scales
// and SH degree 0 as indices into tables of 256 values; opacities in 8 bits; higher SH as an index
// into a palette of at most 65,536 sets. The frame is the .ply's.
// A folder is read by its meta.json.
class SogCodec : public SplatCodec {
 public:
  std::string_view Name() const override { return "SOG (.sog or meta.json)"; }
  std::span<const std::string_view> Extensions() const override;
  bool Sniff(std::string_view head) const override;
  GaussianModel Read(const std::filesystem::path& path, Monitor& monitor) const override;
  bool CanWrite() const override { return false; }
};

}  // namespace retint
