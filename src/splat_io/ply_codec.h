// SPDX-License-Identifier: BSD-3-Clause
// The .ply that 3DGS training code writes (Kerbl et al. 2023, scene/gaussian_model.py save_ply): a
// column a parameter.
#pragma once

#include "splat_io/splat_io.h"

namespace retint {

// Reads binary little-endian and ascii, columns of float or double in any order, and SH degree 0-3
// (0, 9, 24 or 45 f_rest columns, channel-major: f_rest_[c (K - 1) + k - 1]); other scalar columns,
// comments and elements after "vertex" are carried in GaussianModel::source. Writes binary
// little-endian floats, the columns of the source in its order, so that an unedited binary body of
// floats keeps its bytes; the header's lines end in LF, comments come first. A model without a
// source gets the canonical columns, nx ny nz zero. Nothing of a model is lost.
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
