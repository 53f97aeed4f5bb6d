// SPDX-License-Identifier: BSD-3-Clause
#include "scene/sh_rotation.h"

#include <cmath>
#include <numbers>

#include <Eigen/Cholesky>

#include "kernels/common/sh.h"

namespace retint {
namespace {

constexpr int kDirections = 32;  // more than the 7 values of the highest band; even on the sphere

Eigen::Vector3d Direction(int i) {
  const double z = 1 - (2 * i + 1.0) / kDirections;
  const double angle = i * std::numbers::pi * (3 - std::sqrt(5.0));  // golden
  return {std::sqrt(1 - z * z) * std::cos(angle), std::sqrt(1 - z * z) * std::sin(angle), z};
}

}  // namespace

// With A and B the basis at R d and at d of enough directions d, A f' = B f. A band's functions
// span themselves under rotation, so that this has an exact solution for each band.
ShRotation::ShRotation(const Eigen::Quaterniond& rotation) {
  Eigen::MatrixXd turned(kDirections, 16), original(kDirections, 16);
  for (int i = 0; i < kDirections; ++i) {
    const Eigen::Vector3d d = Direction(i), r = rotation * d;
    double basis[16];
    ShBasis(3, r.x(), r.y(), r.z(), basis);
    turned.row(i) = Eigen::Map<const Eigen::RowVectorXd>(basis, 16);
    ShBasis(3, d.x(), d.y(), d.z(), basis);
    original.row(i) = Eigen::Map<const Eigen::RowVectorXd>(basis, 16);
  }
  for (int l = 1; l <= 3; ++l) {
    const Eigen::MatrixXd a = turned.middleCols(l * l, 2 * l + 1);
    const Eigen::MatrixXd b = original.middleCols(l * l, 2 * l + 1);
    bands_[static_cast<size_t>(l - 1)] = (a.transpose() * a).ldlt().solve(a.transpose() * b);
  }
}

void ShRotation::Apply(int degree, float* sh) const {
  for (int l = 1; l <= degree; ++l) {
    Eigen::Map<Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor>> band(sh + 3 * l * l,
                                                                              2 * l + 1, 3);
    const Eigen::MatrixX3d rotated = bands_[static_cast<size_t>(l - 1)] * band.cast<double>();
    band = rotated.cast<float>();
  }
}

}  // namespace retint
