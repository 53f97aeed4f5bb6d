// SPDX-License-Identifier: BSD-3-Clause
#include "splat_io/placement.h"

#include <cmath>

#include <Eigen/Geometry>

namespace retint {

std::optional<Sim3d> SimilarityOf(const Eigen::Matrix4d& matrix) {
  const Eigen::Matrix3d linear = matrix.topLeftCorner<3, 3>();
  const double volume = linear.determinant();
  const double scale = std::cbrt(volume);
  // 1e-4: rounded numbers in a file are only nearly orthogonal.
  if (!(volume > 0) || !matrix.allFinite() ||
      !(linear.transpose() * linear / (scale * scale))
           .isApprox(Eigen::Matrix3d::Identity(), 1e-4)) {
    return std::nullopt;
  }
  return Sim3d{scale, Eigen::Quaterniond(Eigen::Matrix3d(linear / scale)).normalized(),
               matrix.topRightCorner<3, 1>()};
}

Placement::Placement(const Sim3d& new_from_old)
    : new_from_old_(new_from_old),
      sh_rotation_(new_from_old.rotation),
      log_scale_(static_cast<float>(std::log(new_from_old.scale))),
      turns_(new_from_old.rotation.vec().norm() > 1e-12) {
  moves_ = turns_ || new_from_old.scale != 1 || !new_from_old.translation.isZero(0);
}

void Placement::Move(SplatRow& row, int sh_degree) const {
  if (!moves_) return;
  Eigen::Map<Eigen::Vector3f> mean(row.mean.data());
  mean = (new_from_old_ * Eigen::Vector3d(mean.cast<double>())).cast<float>();
  for (float& scale : row.log_scale) scale += log_scale_;
  if (!turns_) return;
  const auto& q = row.quat_wxyz;
  Eigen::Quaterniond own(q[0], q[1], q[2], q[3]);
  if (own.squaredNorm() == 0) own.setIdentity();
  const Eigen::Quaterniond turned = new_from_old_.rotation * own;
  row.quat_wxyz = {float(turned.w()), float(turned.x()), float(turned.y()), float(turned.z())};
  sh_rotation_.Apply(sh_degree, row.sh.data());
}

}  // namespace retint
