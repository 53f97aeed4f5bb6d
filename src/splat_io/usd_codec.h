// SPDX-License-Identifier: BSD-3-Clause
// OpenUSD stages with Gaussians, ParticleField3DGaussianSplat of UsdVol (OpenUSD 26.03,
// openusd.org/release/user_guides): text, packages, and crates.
#pragma once

#include "splat_io/splat_io.h"

namespace retint {

// Reads every visible prim of that type, in order, with the transforms above it (rotations,
// uniform scales, translations), in meters and with y up. Sections of a lower SH degree than the
// largest get zeros. Attributes are floats or halves; missing ones have the schema's fallback.
// Does not follow references, payloads, sublayers or variants, and says so in
// SourceLayout::notes.
//
// Written over a scene that came from the same kind of file, only changed values get new bytes.
// Other attributes, prims and files of a package do not change. Otherwise, the result is one prim
// of floats.
//
// Such a stage is right-up-back, 3DGS .ply right-down-front: y and z change their signs.
class UsdCodec : public SplatCodec {
 public:
  std::string_view Name() const override { return "OpenUSD (ParticleField3DGaussianSplat)"; }
  std::span<const std::string_view> Extensions() const override;
  bool Sniff(std::string_view head) const override;
  GaussianModel Read(const std::filesystem::path& path, Monitor& monitor,
                     BadRows bad = BadRows::kRefuse) const override;
  void Write(const std::filesystem::path& path, const GaussianModel& model,
             Monitor& monitor) const override;
  std::vector<std::string> Losses(const GaussianModel& model) const override;
};

}  // namespace retint
