// SPDX-License-Identifier: BSD-3-Clause
// The place, the size and the up direction of a splat's scene, only from the Gaussians.
#pragma once

#include <array>

#include <Eigen/Core>

#include "scene/gaussian_model.h"

namespace retint {

struct SceneShape {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  // of the part to which most Gaussians belong
  // Distances from the center within which half and 85 % of the opacity lies, world units; above 0.
  double inner_radius = 1, outer_radius = 1;
  Eigen::Vector3d up = -Eigen::Vector3d::UnitY();  // unit
};

// Medians weighted by opacity, so that floaters and sky do not count. Up is -y, as COLMAP leaves a
// scene whose first photo was upright; or z or y, as other tools have it, where Gaussians are flat
// across that axis (floors and tables) and the scene was seen from its side (TrainedShare). It is
// leaned towards the nearest large surface. InputError when no Gaussian is visible.
SceneShape MeasureShape(const GaussianModel& model);

// How much of a Gaussian's directional color speaks of direction `d` (unit, from the camera to the
// Gaussian): its bands above the first at d, squared, over their mean square on the sphere.
// Gradient descent from zero leaves the coefficients in the span of the basis at the directions of
// the training views, so this is high, 1 or more, where a Gaussian was trained from and low
// elsewhere. 1 for a Gaussian without directional color. `sh` is [K, 3].
double TrainedShare(int sh_degree, const float* sh, const Eigen::Vector3d& d);

}  // namespace retint
