// SPDX-License-Identifier: BSD-3-Clause
// Scene graphs that place Gaussians: which transforms a Gaussian supports, and how they change its
// values.
#pragma once

#include <optional>

#include <Eigen/Core>

#include "scene/rigid3d.h"
#include "scene/sh_rotation.h"
#include "splat_io/splat_row.h"

namespace retint {

// The similarity that equals an affine matrix. nullopt if it stretches, shears or mirrors: only
// similarities keep a Gaussian's shape and its harmonics' degree.
std::optional<Sim3d> SimilarityOf(const Eigen::Matrix4d& matrix);

// Transforms rows by a similarity; the identity keeps every bit.
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
