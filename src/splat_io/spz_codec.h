// SPDX-License-Identifier: BSD-3-Clause
// Niantic's .spz (github.com/nianticlabs/spz, README "File Format"): 20 bytes a Gaussian and one a
// coefficient of higher bands, compressed.
#pragma once

#include "splat_io/splat_io.h"

namespace retint {

// Reads versions 1 to 3 (a gzip stream, or unpacked) and 4 (Zstandard streams). Writes the version
// of the source, otherwise 3, which most readers support.
//
// A header of 16 bytes is followed by all positions, then all opacities, colors, scales, rotations
// and SH. Positions are 24-bit fixed-point numbers (version 1: binary16), other values are bytes.
// Log scale = byte / 16 - 10, so scales lie in [e^-10, e^5.9]. SH degree 0 = (byte / 255 - 0.5) /
// 0.15. Higher SH = byte / 128 - 1. A new value of higher SH keeps 5 bits at degree 1 and 4 above,
// as the reference does. Unit quaternions have 24 bits (versions 1, 2) or 32.
//
// SPZ is right-up-back, 3DGS .ply right-down-front. Reading and writing therefore change the signs
// of y and z, and of all values that depend on them. SPZ_ADOBE_coordinate_system in a file names
// another of sixteen systems. SH of degree 4 are not read; SourceLayout::notes says so.
//
// Written over a scene that came from an .spz of the same SH degree, unchanged values keep their
// bytes in the unpacked data.
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
