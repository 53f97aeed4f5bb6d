// SPDX-License-Identifier: BSD-3-Clause
// The .ply of 3DGS training code (Kerbl et al. 2023, save_ply in scene/gaussian_model.py): a column
// for each parameter.
#pragma once

#include "splat_io/splat_io.h"

namespace retint {

// Reads binary little-endian and ascii, columns of float or double in any order. SH degree 0-3 has
// 0, 9, 24 or 45 f_rest columns, channel-major: f_rest_[c (K - 1) + k - 1]. GaussianModel::source
// keeps other scalar columns, comments and elements after "vertex". Writes binary little-endian
// floats in the source's order of columns, so an unedited binary body of floats keeps its bytes.
// Lines of the header end in LF, comments come first. Without a source, the columns are the
// canonical ones, with nx ny nz zero. Nothing of a model is lost.
class PlyCodec : public SplatCodec {
 public:
  std::string_view Name() const override { return "3DGS .ply"; }
  std::span<const std::string_view> Extensions() const override;
  bool Sniff(std::string_view head) const override;
  GaussianModel Read(const std::filesystem::path& path, Monitor& monitor,
                     BadRows bad = BadRows::kRefuse) const override;
  void Write(const std::filesystem::path& path, const GaussianModel& model,
             Monitor& monitor) const override;
};

}  // namespace retint
