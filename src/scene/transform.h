// SPDX-License-Identifier: BSD-3-Clause
// Whole scenes moved by a similarity x_in_new = s (R x_in_old) + t.
#pragma once

#include "scene/gaussian_model.h"
#include "scene/reconstruction.h"
#include "scene/rigid3d.h"

namespace retint {

// b_from_a after a_from_c.
Sim3d Compose(const Sim3d& b_from_a, const Sim3d& a_from_c);

// Poses and points. A camera's own frame keeps its axes and gets the new unit, so that every point
// stays in its pixel: R' = R_cam R^T, t' = s t_cam - R' t.
void Transform(const Sim3d& new_from_old, Reconstruction& model);

// Means, rotations, scales and spherical harmonics (turned by ShRotation). From cameras moved in
// the same way, the scene looks the same, except for Gaussians nearer to a camera than the
// rasterizer draws (docs/conventions.md).
void Transform(const Sim3d& new_from_old, GaussianModel& model);

}  // namespace retint
