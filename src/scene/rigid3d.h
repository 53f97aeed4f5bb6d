// SPDX-License-Identifier: BSD-3-Clause
// Rigid and similarity transforms, named by their frames: x_in_b = b_from_a * x_in_a (COLMAP's
// convention).
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace retint {

// x_in_b = rotation * x_in_a + translation.
struct Rigid3d {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Eigen::Vector3d operator*(const Eigen::Vector3d& x) const { return rotation * x + translation; }
  Rigid3d operator*(const Rigid3d& other) const {
    return {(rotation * other.rotation).normalized(), rotation * other.translation + translation};
  }
  Rigid3d Inverse() const {
    const Eigen::Quaterniond inverse = rotation.conjugate();
    return {inverse, -(inverse * translation)};
  }
  // For cam_from_world: the camera's center in the world.
  Eigen::Vector3d OriginInSource() const { return -(rotation.conjugate() * translation); }

  // The same numbers: q and -q are not.
  bool operator==(const Rigid3d& other) const {
    return rotation.coeffs() == other.rotation.coeffs() && translation == other.translation;
  }
};

// x_in_b = scale * (rotation * x_in_a) + translation.
struct Sim3d {
  double scale = 1;
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Eigen::Vector3d operator*(const Eigen::Vector3d& x) const {
    return scale * (rotation * x) + translation;
  }
  Sim3d Inverse() const {
    const Eigen::Quaterniond inverse = rotation.conjugate();
    return {1 / scale, inverse, -(inverse * translation) / scale};
  }
};

}  // namespace retint
