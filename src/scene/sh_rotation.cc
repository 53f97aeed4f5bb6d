// SPDX-License-Identifier: BSD-3-Clause
#include "scene/sh_rotation.h"

#include <cmath>
#include <numbers>

#include <Eigen/Cholesky>

#include "kernels/common/sh.h"
#include "scene/sh_band4.h"

namespace retint {
namespace {

constexpr int kDirections = 32;  // more than the 9 values of the highest band; even on the sphere
constexpr int kCoeffs = 25;

Eigen::Vector3d Direction(int i) {
  const double z = 1 - (2 * i + 1.0) / kDirections;
  const double angle = i * std::numbers::pi * (3 - std::sqrt(5.0));  // golden
  return {std::sqrt(1 - z * z) * std::cos(angle), std::sqrt(1 - z * z) * std::sin(angle), z};
}

void AllBands(const Eigen::Vector3d& d, double* basis) {
  ShBasis(3, d.x(), d.y(), d.z(), basis);
  ShBand4Basis(d.x(), d.y(), d.z(), basis + 16);
}

}  // namespace

// With A and B the basis at R d and at d of enough directions d, A f' = B f. A band's functions
// span themselves under rotation, so that this has an exact solution for each band.
ShRotation::ShRotation(const Eigen::Quaterniond& rotation) {
  Eigen::MatrixXd turned(kDirections, kCoeffs), original(kDirections, kCoeffs);
  for (int i = 0; i < kDirections; ++i) {
    const Eigen::Vector3d d = Direction(i), r = rotation * d;
    double basis[kCoeffs];
    AllBands(r, basis);
    turned.row(i) = Eigen::Map<const Eigen::RowVectorXd>(basis, kCoeffs);
    AllBands(d, basis);
    original.row(i) = Eigen::Map<const Eigen::RowVectorXd>(basis, kCoeffs);
  }
  for (int l = 1; l <= 4; ++l) {
    const Eigen::MatrixXd a = turned.middleCols(l * l, 2 * l + 1);
    const Eigen::MatrixXd b = original.middleCols(l * l, 2 * l + 1);
    bands_[static_cast<size_t>(l - 1)] = (a.transpose() * a).ldlt().solve(a.transpose() * b);
  }
}

void ShRotation::Apply(int degree, float* sh) const {
  for (int l = 1; l <= degree; ++l) ApplyToBand(l, sh + 3 * l * l);
}

void ShRotation::ApplyToBand4(float* sh) const { ApplyToBand(4, sh); }

void ShRotation::ApplyToBand(int l, float* sh) const {
  Eigen::Map<Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor>> band(sh, 2 * l + 1, 3);
  const Eigen::MatrixX3d rotated = bands_[static_cast<size_t>(l - 1)] * band.cast<double>();
  band = rotated.cast<float>();
}

}  // namespace retint
