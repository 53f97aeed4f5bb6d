// SPDX-License-Identifier: BSD-3-Clause
// The compressed .ply of PlayCanvas and SuperSplat (developer.playcanvas.com, "PLY format";
// github.com/playcanvas/splat-transform): 16 bytes a Gaussian and one a coefficient of higher
// bands.
#pragma once

#include "splat_io/splat_io.h"

namespace retint {

// Three elements, binary little-endian. Each "chunk" has the bounds of 256 Gaussians as
// floats: of position, log scale and color. Without color it has 12 floats instead of 18,
// and colors lie in [0, 1]. Each "vertex" has four words, relative to the bounds of its
// chunk.
//   11, 10 and 11 bits: packed_position and packed_scale.
//   2 bits and 3 times 10: packed_rotation, the index of the largest of wxyz, then the others.
//   8 bits each: packed_color, with red, green, blue and opacity.
// Element "sh" has degrees 1 to 3: uchar f_rest_*, as in the 3DGS .ply, [-4, 4] in 8 bits.
// The frame is that of the 3DGS .ply. Log scales are clamped to [-20, 20].
//
// Scenes from elsewhere are sorted along a Morton curve, so that chunks are small. Written
// over a scene that came from such a file, unchanged values keep their bytes. If a new color
// lies outside its chunk's bounds, the bounds grow and the chunk's colors are packed again.
class CompressedPlyCodec : public SplatCodec {
 public:
  std::string_view Name() const override { return "compressed .ply"; }
  std::span<const std::string_view> Extensions() const override;
  bool Sniff(std::string_view head) const override;
  GaussianModel Read(const std::filesystem::path& path, Monitor& monitor,
                     BadRows bad = BadRows::kRefuse) const override;
  void Write(const std::filesystem::path& path, const GaussianModel& model,
             Monitor& monitor) const override;
  bool Rounds() const override { return true; }
  std::vector<std::string> Losses(const GaussianModel& model) const override;
  std::vector<uint32_t> WriteOrder(const GaussianModel& model) const override;
};

}  // namespace retint
