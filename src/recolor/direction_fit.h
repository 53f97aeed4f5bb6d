// SPDX-License-Identifier: BSD-3-Clause
// Changes of a Gaussian's color in directions all around it, as changes of its coefficients: their
// least-squares fit, one matrix for all Gaussians. Internal to recolor.
#pragma once

#include <cmath>
#include <numbers>
#include <span>

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "kernels/common/sh.h"
#include "kernels/common/sh_edit.h"

namespace retint {

class DirectionFit {
 public:
  using Colors = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  explicit DirectionFit(int num_coeffs) {
    const int degree = int(std::lround(std::sqrt(double(num_coeffs)))) - 1;
    const int directions = num_coeffs == 1 ? 1 : 4 * num_coeffs;
    colors_.resize(directions, num_coeffs);
    for (int i = 0; i < directions; ++i) {  // a Fibonacci lattice
      const double z = 1 - (2 * i + 1.0) / directions, radius = std::sqrt(1 - z * z);
      const double angle = i * std::numbers::pi * (3 - std::sqrt(5.0));
      ShBasis(degree, float(radius * std::cos(angle)), float(radius * std::sin(angle)), float(z),
              colors_.row(i).data());
    }
    const Eigen::MatrixXd basis = colors_.cast<double>();
    fit_ = (basis.transpose() * basis).llt().solve(basis.transpose()).cast<float>();
  }

  // As ShOps::EditSh takes them: [directions, K] and [K, directions].
  std::span<const float> basis() const { return {colors_.data(), size_t(colors_.size())}; }
  std::span<const float> fit() const { return {fit_.data(), size_t(fit_.size())}; }
  int directions() const { return int(colors_.rows()); }

  // [K, 3], for coefficients `sh` [K, 3]: the fit to the values of `change` in each direction.
  // `change` gets the color, which may be negative, and the visible color, max(0, color).
  template <typename Change>
  Colors Fit(const float* sh, const Change& change) const {
    const Eigen::Map<const Colors> coefficients(sh, colors_.cols(), 3);
    Colors changes = (colors_ * coefficients).array() + 0.5f;
    for (Eigen::Index i = 0; i < changes.rows(); ++i) {
      const Eigen::Vector3f color = changes.row(i).transpose();
      const Eigen::Vector3f changed = change(color, Eigen::Vector3f(color.cwiseMax(0.0f)));
      for (int c = 0; c < 3; ++c) changes(i, c) = changed[c];
    }
    return fit_ * changes;
  }

  // ChangeToShow() of each channel.
  static Eigen::Vector3f Rise(const Eigen::Vector3f& wanted, float share,
                              const Eigen::Vector3f& color) {
    Eigen::Vector3f change;
    for (int c = 0; c < 3; ++c) change[c] = ChangeToShow(wanted[c], share, color[c]);
    return change;
  }

 private:
  Colors colors_;  // [directions, K]
  Colors fit_;     // [K, directions]
};

}  // namespace retint
