// SPDX-License-Identifier: BSD-3-Clause
// glTF 2.0 with the extension KHR_gaussian_splatting (github.com/KhronosGroup/glTF,
// extensions/2.0/Khronos/KHR_gaussian_splatting), as .glb or .gltf.
#pragma once

#include "splat_io/splat_io.h"

namespace retint {

// Reads every primitive with the extension that the scene's nodes show, one after the other, under
// their nodes' transforms (rotations, uniform scales, translations); sections of a lower SH degree
// than the largest get zeros. Other meshes are left out; SourceLayout::notes says so. Compressed
// primitives are refused by the name of their extension. A .gltf names its buffers or holds them.
//
// The extension names attributes of spherical harmonics of degrees 0 to 3 and no others
// ("Attributes" in its README), so degree 4 is neither read nor written; notes and Losses() say so.
//
// Writes one primitive of floats, with COLOR_0 for viewers that know only points; a .gltf holds its
// buffer. Scales are linear and opacities activated, as the ratified extension has them.
//
// glTF is left-up-front, 3DGS .ply right-down-front: x and y, and all that follows from them,
// change sign on the way in and out.
class GltfCodec : public SplatCodec {
 public:
  std::string_view Name() const override { return "glTF (KHR_gaussian_splatting)"; }
  std::span<const std::string_view> Extensions() const override;
  bool Sniff(std::string_view head) const override;
  GaussianModel Read(const std::filesystem::path& path, Monitor& monitor,
                     BadRows bad = BadRows::kRefuse) const override;
  std::vector<std::filesystem::path> Files(const std::filesystem::path& path) const override;
  void Write(const std::filesystem::path& path, const GaussianModel& model,
             Monitor& monitor) const override;
  std::vector<std::string> Losses(const GaussianModel& model) const override;
};

}  // namespace retint
