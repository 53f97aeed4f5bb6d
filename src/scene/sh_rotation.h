// SPDX-License-Identifier: BSD-3-Clause
// Spherical harmonics of a scene that is turned.
#pragma once

#include <array>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace retint {

// Coefficients f' of the turned function, f'(R d) = f(d) for every direction d, degree 0 to 4.
class ShRotation {
 public:
  // R = `rotation`.
  explicit ShRotation(const Eigen::Quaterniond& rotation);
  // In place: `sh` is [K, 3], K = (degree + 1)^2, in the order of docs/conventions.md.
  void Apply(int degree, float* sh) const;  // `degree` up to 3
  void ApplyToBand4(float* sh) const;       // [9, 3]

 private:
  void ApplyToBand(int l, float* sh) const;

  std::array<Eigen::MatrixXd, 4> bands_;  // of degree 1 to 4: [2l + 1, 2l + 1]
};

}  // namespace retint
