// SPDX-License-Identifier: BSD-3-Clause
// Niantic's .spz (github.com/nianticlabs/spz, README "File Format"): 20 bytes a Gaussian and one a
// coefficient of higher bands, compressed.
#pragma once

#include "splat_io/splat_io.h"

namespace retint {

// Reads versions 1 to 3 (a gzip stream; also unpacked) and 4 (Zstandard streams). Writes the
// version that the scene was read from, else 3, which most readers take.
//
// A header of 16 bytes, then all positions, opacities, colors, scales, rotations and SH, each
// together: positions are 24-bit fixed-point numbers (version 1: binary16), the rest bytes;
// log scale = byte / 16 - 10, so that scales lie in [e^-10, e^5.9]; SH degree 0 = (byte / 255 -
// 0.5) / 0.15; higher SH = byte / 128 - 1, of which a new value keeps 5 bits at degree 1 and 4
// above, as the reference does; the unit quaternion in 24 bits (versions 1, 2) or 32.
//
// SPZ is right-up-back, 3DGS .ply right-down-front: y and z, and all that follows from them,
// change sign on the way in and out. SPZ_ADOBE_coordinate_system, where a file has it, names
// another of sixteen systems. SH of degree 4 are not read; SourceLayout::notes says so.
//
// Written over a scene that came from an .spz of the same SH degree, values that did not change
// keep their bytes inside of the compressed data.
class SpzCodec : public SplatCodec {
 public:
  std::string_view Name() const override { return ".spz"; }
  std::span<const std::string_view> Extensions() const override;
  bool Sniff(std::string_view head) const override;
  GaussianModel Read(const std::filesystem::path& path, Monitor& monitor,
                     BadRows bad = BadRows::kRefuse) const override;
  void Write(const std::filesystem::path& path, const GaussianModel& model,
             Monitor& monitor) const override;
  bool Rounds() const override { return true; }
  std::vector<std::string> Losses(const GaussianModel& model) const override;
};

}  // namespace retint
