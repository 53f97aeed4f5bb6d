// SPDX-License-Identifier: BSD-3-Clause
// The least-squares problems of the registration. Only its .cc includes Ceres in this folder.
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "scene/rigid3d.h"

namespace retint {

// A cloud point and its sparse point, which should coincide, in the reference camera's frame.
// `normal` is the surface's unit normal there, or zero if it is unreliable.
struct RegistrationPair {
  Eigen::Vector3d cloud = Eigen::Vector3d::Zero();
  Eigen::Vector3d sparse = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  bool heldout = false;
};

// 1/z' = a (1/z) + b along the ray, then a similarity about `center`, all in the reference
// camera's frame: x' = center + scale * rotation * (x - center) + translation.
struct RegistrationTransform {
  double a = 1, b = 0;
  double log_scale = 0;
  Eigen::Vector3d angle_axis = Eigen::Vector3d::Zero();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();
  Eigen::Vector3d center = Eigen::Vector3d::Zero();

  Sim3d Similarity() const;  // the second part, cam_from_corrected
};

// A transform for many points. It computes their common part once.
class RegistrationMap {
 public:
  explicit RegistrationMap(const RegistrationTransform& transform);
  Eigen::Vector3d operator*(const Eigen::Vector3d& point_in_cam) const {
    return similarity_ * (point_in_cam / (a_ + b_ * point_in_cam.z()));
  }
  const Sim3d& similarity() const { return similarity_; }

  // Of the moved point with respect to a, b, log_scale, angle_axis, translation.
  using Derivatives = Eigen::Matrix<double, 3, 9>;
  Derivatives DerivativesAt(const Eigen::Vector3d& point_in_cam) const;

 private:
  double a_, b_;
  Sim3d similarity_;
  Eigen::Vector3d center_;
  Eigen::Matrix3d scaled_rotation_;
  Eigen::Matrix3d turn_by_angle_axis_;  // see the constructor
};

// Robust spread of the depth ratio log(z_sparse / z_cloud) of the pairs, 1.4826 * median |.| about
// its median; at least 0.1 %. It is the unit of the residuals below.
double DepthNoise(const std::vector<RegistrationPair>& pairs, const RegistrationTransform& at);

// Fits only a and b: residual ((a / z_cloud + b) z_sparse - 1) / noise, Cauchy loss of scale 1,
// priors of 10 % at a = 1, b = 0. Ignores held-out pairs. Returns why Ceres stopped.
std::string FitDepth(const std::vector<RegistrationPair>& pairs, double noise,
                     RegistrationTransform* transform);

// Refines everything. With a good normal: point-to-plane in units of noise * z, and three times
// weaker along the plane, because both points come from one pixel. Otherwise point-to-point. Cauchy
// loss of scale 1 per pair. Priors: 10 % on a, b and scale, 3 degrees on rotation, 10 % of the
// depth on translation.
std::string FitAll(const std::vector<RegistrationPair>& pairs, double noise,
                   RegistrationTransform* transform);

}  // namespace retint
