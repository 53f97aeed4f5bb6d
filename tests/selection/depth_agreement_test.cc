// SPDX-License-Identifier: BSD-3-Clause
#include "selection/depth_agreement.h"

#include <gtest/gtest.h>

#include "kernels/backend.h"

namespace retint {
namespace {

DepthView Wall(float depth) {
  DepthView view;
  view.camera.camera = Camera::Pinhole(1, 16, 16, 16, 16, 8, 8);
  view.depth = DepthMap(16, 16, depth);
  return view;
}

TEST(DepthAgreement, DownloadsEveryDepth) {
  const std::shared_ptr<Backend> backend = CreateBackend("cpu");
  DepthView wall = Wall(2);
  wall.depth(15, 15) = 3;
  const Buffer<float> depth = backend->Upload<float>(wall.depth.data);
  const DepthView back = Downloaded(*backend, wall.camera, depth);
  EXPECT_EQ(back.depth.data, wall.depth.data);
}

TEST(DepthAgreement, ComparesEveryFourthPixelWithTheOtherView) {
  std::vector<float> differences;
  AddDifferences(Wall(2.02f), Wall(2), 0.03f, &differences);
  ASSERT_EQ(differences.size(), 16u);
  for (const float difference : differences) EXPECT_NEAR(difference, 0.01f, 1e-5f);
}

TEST(DepthAgreement, LeavesOutOtherSurfacesAndPixelsWithoutOne) {
  std::vector<float> differences;
  AddDifferences(Wall(2.1f), Wall(2), 0.03f, &differences);
  AddDifferences(Wall(0), Wall(2), 0.03f, &differences);
  AddDifferences(Wall(2), Wall(0), 0.03f, &differences);
  EXPECT_TRUE(differences.empty());
}

TEST(DepthAgreement, LeavesOutPixelsBesideTheOtherView) {
  DepthView other = Wall(2);
  other.camera.cam_from_world.translation.x() = 1;  // half of the picture to the side
  std::vector<float> differences;
  AddDifferences(Wall(2), other, 0.03f, &differences);
  EXPECT_GT(differences.size(), 0u);
  EXPECT_LT(differences.size(), 16u);
}

TEST(DepthAgreement, TakesThreeTimesWhatMostKeepWithin) {
  std::vector<float> differences(80, 0.004f);
  differences.resize(100, 0.02f);
  EXPECT_NEAR(AgreeingTolerance(differences, 0.03f), 0.012f, 1e-6f);
}

TEST(DepthAgreement, KeepsToItsLimits) {
  std::vector<float> close(100, 0.0001f), far(100, 0.02f), none;
  EXPECT_EQ(AgreeingTolerance(close, 0.03f), kSameSurface);
  EXPECT_EQ(AgreeingTolerance(far, 0.03f), 0.03f);
  EXPECT_EQ(AgreeingTolerance(none, 0.03f), 0.03f);
}

}  // namespace
}  // namespace retint
