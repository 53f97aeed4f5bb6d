// SPDX-License-Identifier: BSD-3-Clause
// Scene graphs that place Gaussians: the transforms that Gaussians can take, and a row moved by
// one.
#pragma once

#include <optional>

#include <Eigen/Core>

#include "scene/rigid3d.h"
#include "scene/sh_rotation.h"
#include "splat_io/splat_row.h"

namespace retint {

// The similarity that an affine matrix is; nullopt where it stretches, shears or mirrors: a
// Gaussian keeps its shape, and its harmonics their degree, only under similarities.
std::optional<Sim3d> SimilarityOf(const Eigen::Matrix4d& matrix);

// Rows under a similarity; the identity keeps every bit.
class Placement {
 public:
  explicit Placement(const Sim3d& new_from_old);
  void Move(SplatRow& row, int sh_degree) const;

 private:
  Sim3d new_from_old_;
  ShRotation sh_rotation_;
  float log_scale_;
  bool moves_, turns_;
};

}  // namespace retint
