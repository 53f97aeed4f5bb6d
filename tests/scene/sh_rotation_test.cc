// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "kernels/common/sh.h"
#include "scene/sh_band4.h"
#include "scene/sh_rotation.h"

namespace retint {
namespace {

TEST(ShRotationTest, TheTurnedFunctionHasTheSameValueTowardsTheTurnedDirection) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> draw(-1, 1);
  for (int trial = 0; trial < 20; ++trial) {
    const Eigen::Quaterniond rotation =
        Eigen::Quaterniond(draw(random), draw(random), draw(random), draw(random)).normalized();
    for (int degree = 0; degree <= 3; ++degree) {
      const int coefficients = (degree + 1) * (degree + 1);
      std::vector<float> sh(static_cast<size_t>(coefficients) * 3);
      for (float& value : sh) value = draw(random);
      std::vector<float> turned = sh;
      ShRotation(rotation).Apply(degree, turned.data());
      const Eigen::Vector3d d =
          Eigen::Vector3d(draw(random), draw(random), draw(random)).normalized();
      const Eigen::Vector3d r = rotation * d;
      double at_d[16], at_r[16];
      ShBasis(degree, d.x(), d.y(), d.z(), at_d);
      ShBasis(degree, r.x(), r.y(), r.z(), at_r);
      for (size_t c = 0; c < 3; ++c) {
        double before = 0, after = 0;
        for (size_t k = 0; k < size_t(coefficients); ++k) {
          before += at_d[k] * double(sh[3 * k + c]);
          after += at_r[k] * double(turned[3 * k + c]);
        }
        // 16 products of floats up to about 1.
        EXPECT_NEAR(after, before, 1e-5);
      }
    }
  }
}

TEST(ShRotationTest, DegreeFourTurnsToo) {
  std::mt19937 random(2);
  std::uniform_real_distribution<float> draw(-1, 1);
  for (int trial = 0; trial < 20; ++trial) {
    const Eigen::Quaterniond rotation =
        Eigen::Quaterniond(draw(random), draw(random), draw(random), draw(random)).normalized();
    std::vector<float> sh(27);
    for (float& value : sh) value = draw(random);
    std::vector<float> turned = sh;
    ShRotation(rotation).ApplyToBand4(turned.data());
    const Eigen::Vector3d d =
        Eigen::Vector3d(draw(random), draw(random), draw(random)).normalized();
    const Eigen::Vector3d r = rotation * d;
    double at_d[9], at_r[9];
    ShBand4Basis(d.x(), d.y(), d.z(), at_d);
    ShBand4Basis(r.x(), r.y(), r.z(), at_r);
    for (size_t c = 0; c < 3; ++c) {
      double before = 0, after = 0;
      for (size_t k = 0; k < 9; ++k) {
        before += at_d[k] * double(sh[3 * k + c]);
        after += at_r[k] * double(turned[3 * k + c]);
      }
      // Nine products of floats up to about 2.
      EXPECT_NEAR(after, before, 1e-5);
    }
  }
}

// Orthonormal, among themselves and to the bands below: sums over directions that are even on the
// sphere stand for its integrals.
TEST(ShRotationTest, DegreeFourIsOrthonormal) {
  constexpr int kDirections = 20000;
  Eigen::MatrixXd products = Eigen::MatrixXd::Zero(25, 25);
  for (int i = 0; i < kDirections; ++i) {
    const double z = 1 - (2 * i + 1.0) / kDirections;
    const double angle = i * 2.399963229728653, side = std::sqrt(1 - z * z);
    Eigen::VectorXd basis(25);
    ShBasis(3, side * std::cos(angle), side * std::sin(angle), z, basis.data());
    ShBand4Basis(side * std::cos(angle), side * std::sin(angle), z, basis.data() + 16);
    products += 4 * M_PI / kDirections * basis * basis.transpose();
  }
  // 20,000 directions miss the integrals of such smooth functions by less.
  EXPECT_LT((products - Eigen::MatrixXd::Identity(25, 25)).cwiseAbs().maxCoeff(), 1e-3);
}

TEST(ShRotationTest, NoRotationChangesNothingToSpeakOf) {
  std::vector<float> sh(48);
  for (size_t i = 0; i < sh.size(); ++i) sh[i] = static_cast<float>(i) / 48;
  std::vector<float> turned = sh;
  ShRotation(Eigen::Quaterniond::Identity()).Apply(3, turned.data());
  for (size_t i = 0; i < sh.size(); ++i) EXPECT_NEAR(turned[i], sh[i], 1e-6);
}

}  // namespace
}  // namespace retint
