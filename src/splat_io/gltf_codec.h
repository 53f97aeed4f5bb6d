// SPDX-License-Identifier: BSD-3-Clause
// glTF 2.0 with the extension KHR_gaussian_splatting (github.com/KhronosGroup/glTF,
// extensions/2.0/Khronos/KHR_gaussian_splatting), as .glb or .gltf.
#pragma once

#include "splat_io/splat_io.h"

namespace retint {

// Reads every primitive with the extension in the nodes of the scene, in order, with their nodes'
// transforms (rotations, uniform scales, translations). Primitives of a lower SH degree than the
// largest get zeros. Ignores other meshes and says so in SourceLayout::notes. Rejects compressed
// primitives, with the name of their extension. A .gltf refers to its buffers or contains them.
//
// The extension names attributes of SH of degrees 0 to 3 ("Attributes" in its README). Degree 4 is
// neither read nor written, which notes and Losses() report.
//
// Writes one primitive of floats, with COLOR_0 for viewers that know only points. A .gltf contains
// its buffer. Scales are linear and opacities activated, as in the ratified extension.
//
// glTF is left-up-front, 3DGS .ply right-down-front. Reading and writing therefore change the signs
// of x and y, and of all values that depend on them.
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
