// SPDX-License-Identifier: BSD-3-Clause
// The pose of a camera that looks along a direction.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "scene/rigid3d.h"

namespace retint {

// cam_from_world of a camera at `eye` that looks along `forward`; the picture's top is where `up`
// points.
inline Rigid3d LookAlong(const Eigen::Vector3d& eye, const Eigen::Vector3d& forward,
                         const Eigen::Vector3d& up) {
  const Eigen::Vector3d z = forward.normalized();
  Eigen::Vector3d x = z.cross(up);
  if (x.norm() < 1e-6) x = z.unitOrthogonal();
  x.normalize();
  Eigen::Matrix3d rotation;  // rows: right, down, forward
  rotation << x.transpose(), z.cross(x).transpose(), z.transpose();
  return {Eigen::Quaterniond(rotation), -(rotation * eye)};
}

}  // namespace retint
