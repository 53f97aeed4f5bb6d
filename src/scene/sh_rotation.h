// SPDX-License-Identifier: BSD-3-Clause
// Spherical harmonics of a scene that is turned.
#pragma once

#include <array>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace retint {

// Coefficients f' of the turned function, f'(R d) = f(d) for every direction d, degree 0 to 3.
class ShRotation {
 public:
  // R = `rotation`.
  explicit ShRotation(const Eigen::Quaterniond& rotation);
  // In place: `sh` is [K, 3], K = (degree + 1)^2, in the order of docs/conventions.md.
  void Apply(int degree, float* sh) const;

 private:
  std::array<Eigen::MatrixXd, 3> bands_;  // of degree 1, 2, 3: [2l + 1, 2l + 1]
};

}  // namespace retint
