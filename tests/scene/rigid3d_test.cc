// SPDX-License-Identifier: BSD-3-Clause
#include "scene/rigid3d.h"

#include <numbers>

#include <gtest/gtest.h>

namespace retint {
namespace {

// A few roundings of numbers of the order of 1 to 10.
constexpr double kRounding = 1e-14;

const Rigid3d kB_from_a = {Eigen::Quaterniond(0.8, -0.3, 0.4, 0.1).normalized(), {1, -2, 3}};
const Rigid3d kC_from_b = {Eigen::Quaterniond(0.1, 0.6, -0.2, 0.7).normalized(), {-4, 0.5, 2}};
const Eigen::Vector3d kPoint(0.7, -1.1, 2.5);

TEST(Rigid3dTest, QuarterTurnAboutZ) {
  const double half = std::numbers::pi / 4;
  const Rigid3d turn = {Eigen::Quaterniond(std::cos(half), 0, 0, std::sin(half)), {10, 0, 0}};
  EXPECT_LT((turn * Eigen::Vector3d(1, 0, 0) - Eigen::Vector3d(10, 1, 0)).norm(), kRounding);
}

TEST(Rigid3dTest, ComposesRightToLeft) {
  const Rigid3d c_from_a = kC_from_b * kB_from_a;
  EXPECT_LT((c_from_a * kPoint - kC_from_b * (kB_from_a * kPoint)).norm(), kRounding);
  EXPECT_NEAR(c_from_a.rotation.norm(), 1, kRounding);
}

TEST(Rigid3dTest, InverseUndoes) {
  EXPECT_LT((kB_from_a.Inverse() * (kB_from_a * kPoint) - kPoint).norm(), kRounding);
  EXPECT_LT((kB_from_a * (kB_from_a.Inverse() * kPoint) - kPoint).norm(), kRounding);
}

TEST(Rigid3dTest, OriginInSourceMapsToZero) {
  EXPECT_LT((kB_from_a * kB_from_a.OriginInSource()).norm(), kRounding);
  EXPECT_GT(kB_from_a.OriginInSource().norm(), 1);
}

TEST(Sim3dTest, ScalesBeforeItMoves) {
  const Sim3d twice = {2, Eigen::Quaterniond::Identity(), {1, 0, 0}};
  EXPECT_EQ(twice * Eigen::Vector3d(1, 1, 1), Eigen::Vector3d(3, 2, 2));
}

TEST(Sim3dTest, InverseUndoes) {
  const Sim3d b_from_a = {0.37, kB_from_a.rotation, kB_from_a.translation};
  EXPECT_LT((b_from_a.Inverse() * (b_from_a * kPoint) - kPoint).norm(), 10 * kRounding);
  EXPECT_NEAR(b_from_a.Inverse().scale, 1 / 0.37, kRounding);
}

}  // namespace
}  // namespace retint
