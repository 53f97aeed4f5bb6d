// SPDX-License-Identifier: BSD-3-Clause
#include "selection/views_between.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "scene/look_along.h"

namespace retint {
namespace {

using Eigen::Vector3d;

const Vector3d kMiddle(0.3, -0.2, 0.5);
const Vector3d kUp = -Vector3d::UnitY();
const Camera kLens = Camera::Pinhole(7, 64, 48, 50, 50, 32, 24);

// Degrees about the vertical through the middle, and above the horizon.
PosedCamera At(double around, double height = 0, double distance = 2) {
  const double turn = around * std::numbers::pi / 180, rise = height * std::numbers::pi / 180;
  const Vector3d offset = distance * Vector3d(std::cos(rise) * std::cos(turn), -std::sin(rise),
                                              std::cos(rise) * std::sin(turn));
  return {Camera::Pinhole(1, 32, 32, 30, 30, 16, 16), LookAlong(kMiddle + offset, -offset, kUp)};
}

double Around(const PosedCamera& view) {
  const Vector3d offset = view.Center() - kMiddle;
  const double degrees = std::atan2(offset.z(), offset.x()) * 180 / std::numbers::pi;
  return degrees < -1e-6 ? degrees + 360 : degrees;
}

std::vector<double> AllAround(const std::vector<PosedCamera>& views) {
  std::vector<double> around;
  for (const PosedCamera& view : views) around.push_back(Around(view));
  std::sort(around.begin(), around.end());
  return around;
}

TEST(ViewsBetween, PartTheGapsEvenlyAndLookAtTheMiddle) {
  const auto views = ViewsBetween({At(0), At(90), At(180), At(270)}, kMiddle, kLens, 100);
  std::vector<double> expected;
  for (int degrees = 15; degrees < 360; degrees += 15) {
    if (degrees % 90 != 0) expected.push_back(degrees);
  }
  const auto around = AllAround(views);
  ASSERT_EQ(around.size(), expected.size());
  for (size_t i = 0; i < around.size(); ++i) EXPECT_NEAR(around[i], expected[i], 1e-6);
  for (const PosedCamera& view : views) {
    EXPECT_EQ(view.camera, kLens);
    const auto seen = view.Project(kMiddle);
    ASSERT_TRUE(seen);
    EXPECT_NEAR((*seen - Vector3d(32, 24, 2)).norm(), 0, 1e-6);
    EXPECT_LT(view.Project(kMiddle + 0.1 * kUp)->y(), 23);  // upright
  }
}

TEST(ViewsBetween, BeginWithTheWidestGap) {
  const std::vector<PosedCamera> cameras = {At(0), At(100), At(160), At(250)};
  const auto one = AllAround(ViewsBetween(cameras, kMiddle, kLens, 1));
  ASSERT_EQ(one.size(), 1u);
  EXPECT_NEAR(one[0], 305, 1e-6);
  const auto two = AllAround(ViewsBetween(cameras, kMiddle, kLens, 2));
  ASSERT_EQ(two.size(), 2u);
  EXPECT_NEAR(two[0], 50, 1e-6);
  EXPECT_TRUE(ViewsBetween(cameras, kMiddle, kLens, 0).empty());
}

TEST(ViewsBetween, StandBetweenTheirCamerasInHeightAndDistance) {
  // Those that look down lean to the middle, but not both to one side.
  const auto views = ViewsBetween({At(0, 0, 1), At(90, 30, 4), At(180, 0, 1), At(270, 30, 4)},
                                  kMiddle, kLens, 100);
  const auto half = std::find_if(views.begin(), views.end(), [](const PosedCamera& view) {
    return std::abs(Around(view) - 45) < 1e-6;
  });
  ASSERT_NE(half, views.end());
  const Vector3d offset = half->Center() - kMiddle;
  EXPECT_NEAR(offset.norm(), 2, 1e-6);  // between 1 and 4 in proportion
  EXPECT_NEAR(std::asin(offset.dot(kUp) / 2) * 180 / std::numbers::pi, 15, 1e-6);
}

// A capture from one side: nobody knows what its back looks like from there.
TEST(ViewsBetween, DoNotGoWhereNobodyLookedFrom) {
  const auto around = AllAround(ViewsBetween({At(60), At(90), At(130)}, kMiddle, kLens, 100));
  ASSERT_EQ(around.size(), 3u);
  EXPECT_GT(around.front(), 60);
  EXPECT_LT(around.back(), 130);
  EXPECT_TRUE(ViewsBetween({At(60), At(70), At(80)}, kMiddle, kLens, 100).empty());
}

TEST(ViewsBetween, AreNoneWithoutCamerasAroundTheMiddle) {
  EXPECT_TRUE(ViewsBetween({}, kMiddle, kLens, 9).empty());
  EXPECT_TRUE(ViewsBetween({At(0)}, kMiddle, kLens, 9).empty());
  PosedCamera away = At(90), inside = At(0);
  away.cam_from_world = LookAlong(away.Center(), away.Center() - kMiddle, kUp);
  inside.cam_from_world = LookAlong(kMiddle, Vector3d::UnitX(), kUp);
  EXPECT_TRUE(ViewsBetween({At(0), away}, kMiddle, kLens, 9).empty());
  EXPECT_TRUE(ViewsBetween({At(0), inside}, kMiddle, kLens, 9).empty());
  PosedCamera upside_down = At(90);
  upside_down.cam_from_world =
      LookAlong(upside_down.Center(), kMiddle - upside_down.Center(), -kUp);
  EXPECT_TRUE(ViewsBetween({At(0), upside_down}, kMiddle, kLens, 9).empty());
}

}  // namespace
}  // namespace retint
