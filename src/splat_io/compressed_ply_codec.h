// SPDX-License-Identifier: BSD-3-Clause
// The compressed .ply of PlayCanvas and SuperSplat (developer.playcanvas.com, "PLY format";
// github.com/playcanvas/splat-transform): 16 bytes a Gaussian and one a coefficient of higher
// bands.
#pragma once

#include "splat_io/splat_io.h"

namespace retint {

// Elements, binary little-endian:
//   chunk   for every 256 Gaussians the bounds of position, log scale and color, as floats
//           (12 or, with color, 18; without, colors lie in [0, 1])
//   vertex  packed_position and packed_scale, 11, 10 and 11 bits of the way through the chunk's
//           bounds; packed_rotation, the index of the quaternion's (wxyz) largest component and
//           the others in 10 bits each; packed_color, red, green and blue in 8 bits through the
//           chunk's bounds, and 8 bits of opacity
//   sh      for degrees 1 to 3: uchar f_rest_*, as in the 3DGS .ply, [-4, 4] in 8 bits
// The frame is the 3DGS .ply's. Log scales are clamped to [-20, 20].
//
// A scene from elsewhere is sorted along a Morton curve, so that chunks are small. Written over a
// scene that came from such a file, values that did not change keep their bytes; where a new color
// lies outside its chunk's bounds, these grow and the colors of that chunk are packed anew.
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
