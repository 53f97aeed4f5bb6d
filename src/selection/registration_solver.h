// SPDX-License-Identifier: BSD-3-Clause
// The least-squares problems of the registration: the only door to Ceres in this folder.
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "scene/rigid3d.h"

namespace retint {

// A cloud point and the sparse point that it should coincide with, both in the reference camera's
// frame. `normal` is the surface's unit normal there, or zero where it is not to be trusted.
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

// A transform for many points: their common part is worked out once.
class RegistrationMap {
 public:
  explicit RegistrationMap(const RegistrationTransform& transform);
  Eigen::Vector3d operator*(const Eigen::Vector3d& point_in_cam) const {
    return similarity_ * (point_in_cam / (a_ + b_ * point_in_cam.z()));
  }
  const Sim3d& similarity() const { return similarity_; }

  // Of the moved point by a, b, log_scale, angle_axis, translation.
  using Derivatives = Eigen::Matrix<double, 3, 9>;
  Derivatives DerivativesAt(const Eigen::Vector3d& point_in_cam) const;

 private:
  double a_, b_;
  Sim3d similarity_;
  Eigen::Vector3d center_;
  Eigen::Matrix3d scaled_rotation_;
  Eigen::Matrix3d turn_by_angle_axis_;  // see the constructor
};

// Robust spread (1.4826 * median |.|) of the pairs' depth ratio log(z_sparse / z_cloud) about its
// median, at least 0.1 %: the unit of the residuals below.
double DepthNoise(const std::vector<RegistrationPair>& pairs, const RegistrationTransform& at);

// Fits a and b alone: residual ((a / z_cloud + b) z_sparse - 1) / noise, Cauchy of scale 1, priors
// of 10 % at a = 1, b = 0. Held-out pairs are left out. Returns why Ceres stopped.
std::string FitDepth(const std::vector<RegistrationPair>& pairs, double noise,
                     RegistrationTransform* transform);

// Refines everything: point-to-plane in units of noise * z where the normal is good, with a tie
// three times weaker within the plane (the pair shares a pixel, so sliding is wrong too);
// point-to-point elsewhere. Cauchy of scale 1 a pair; priors of 10 % on a, b and scale, 3 degrees
// on rotation, 10 % of the depth on translation.
std::string FitAll(const std::vector<RegistrationPair>& pairs, double noise,
                   RegistrationTransform* transform);

}  // namespace retint
