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

// Medians weighted by opacity, so that floaters and sky do not count. Up is -y, as in COLMAP if the
// first photo was upright. Or it is z or y, as in other tools, if Gaussians are flat across that
// axis (floors and tables) and the scene was seen from its side (TrainedShare). It is then turned
// to the normal of the surfaces that are nearly level. InputError if no Gaussian is visible.
SceneShape MeasureShape(const GaussianModel& model);

// How much of a Gaussian's directional color was trained for direction `d` (unit, from the camera
// to the Gaussian): its bands above the first at d, squared, over their mean square on the sphere.
// Gradient descent from zero leaves the coefficients in the span of the basis at the directions of
// the training views. So this is 1 or more in a trained direction, and low in others. It is 1 for a
// Gaussian without directional color. `sh` is [K, 3].
double TrainedShare(int sh_degree, const float* sh, const Eigen::Vector3d& d);

}  // namespace retint
