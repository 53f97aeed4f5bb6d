// SPDX-License-Identifier: BSD-3-Clause
// The .splat of antimatter15's viewer (github.com/antimatter15/splat): no header, 32 bytes a
// Gaussian.
#pragma once

#include "splat_io/splat_io.h"

namespace retint {

// A record: position and linear scale as floats; red, green, blue and opacity as bytes of [0, 1];
// the unit quaternion wxyz as bytes q * 128 + 128. The frame is that of the .ply. View-dependent
// color is lost, so SH degree is 0. Colors are clamped to [0, 1]. Written over a scene that came
// from a .splat, unchanged values keep their bytes.
class DotSplatCodec : public SplatCodec {
 public:
  std::string_view Name() const override { return ".splat"; }
  std::span<const std::string_view> Extensions() const override;
  bool Sniff(std::string_view) const override { return false; }
  GaussianModel Read(const std::filesystem::path& path, Monitor& monitor,
                     BadRows bad = BadRows::kRefuse) const override;
  void Write(const std::filesystem::path& path, const GaussianModel& model,
             Monitor& monitor) const override;
  bool Rounds() const override { return true; }
  std::vector<std::string> Losses(const GaussianModel& model) const override;
};

}  // namespace retint
