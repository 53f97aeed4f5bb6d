// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/canvas/navigation.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace retint {
namespace {

// Cameras on a circle of radius 4 around the origin, y down, level, looking at it; points about it.
Reconstruction Ring(int views) {
  Reconstruction ring;
  ring.cameras[1] = Camera::Pinhole(1, 200, 100, 150, 140, 90, 60);
  for (int v = 0; v < views; ++v) {
    View view;
    view.id = ViewId(v + 1);
    view.name = std::to_string(v);
    view.camera_id = 1;
    view.cam_from_world.rotation = Eigen::Quaterniond(
        Eigen::AngleAxisd(2 * std::numbers::pi * v / views, Eigen::Vector3d::UnitY()));
    view.cam_from_world.translation = {0, 0, 4};
    ring.views[view.id] = view;
  }
  for (int p = 0; p < 27; ++p) {
    SparsePoint point;
    point.xyz = {p % 3 - 1.0, p / 3 % 3 - 1.0, p / 9 - 1.0};
    ring.points[PointId(p + 1)] = point;
  }
  return ring;
}

class NavigationTest : public testing::Test {
 protected:
  NavigationTest() {
    navigation_.SetViewport(800, 600);
    navigation_.SetScene(ring_);
  }
  Eigen::Vector3d Position() const { return navigation_.Rendered().Center(); }
  Eigen::Vector3d Axis(int index) const {
    return navigation_.Rendered().cam_from_world.rotation.toRotationMatrix().row(index).transpose();
  }

  Reconstruction ring_ = Ring(8);
  Navigation navigation_;
};

TEST_F(NavigationTest, KnowsUpCenterAndSize) {
  EXPECT_NEAR(navigation_.up().y(), -1, 1e-9);
  EXPECT_LT(navigation_.center().norm(), 1e-9);
  EXPECT_GT(navigation_.radius(), 0.9);
  EXPECT_LT(navigation_.radius(), 1.8);
}

TEST_F(NavigationTest, WithoutPointsTheCenterIsWhatTheViewsLookAt) {
  ring_.points.clear();
  navigation_.SetScene(ring_);
  EXPECT_LT(navigation_.center().norm(), 1e-3);
  EXPECT_GT(navigation_.radius(), 0);
}

TEST_F(NavigationTest, WithoutAnythingThereStillIsACamera) {
  navigation_.SetScene({});
  EXPECT_EQ(navigation_.view(), nullptr);
  EXPECT_TRUE(navigation_.Rendered().cam_from_world.translation.allFinite());
  navigation_.Orbit(10, 10);
  navigation_.Reset();
  EXPECT_TRUE(Position().allFinite());
}

TEST_F(NavigationTest, AViewKeepsItsAspectInAnyViewport) {
  for (const auto& [width, height] : {std::pair{800, 600}, {300, 900}, {57, 31}, {1, 1}}) {
    navigation_.SetViewport(width, height);
    const Camera camera = navigation_.Rendered().camera;
    EXPECT_LE(camera.width, width);
    EXPECT_LE(camera.height, height);
    EXPECT_TRUE(camera.width == width || camera.height == height);
    EXPECT_NEAR(camera.fx() / camera.width, 150.0 / 200, 1e-12);
    EXPECT_NEAR(camera.fy() / camera.height, 140.0 / 100, 1e-12);
    EXPECT_NEAR(camera.cx() / camera.width, 90.0 / 200, 1e-12);
  }
  EXPECT_EQ(navigation_.Exact().camera, ring_.cameras[1]);
}

TEST_F(NavigationTest, LeavingAViewDoesNotJump) {
  const PosedCamera before = navigation_.Rendered();
  navigation_.Orbit(0, 0);
  EXPECT_EQ(navigation_.view(), nullptr);
  const PosedCamera after = navigation_.Rendered();
  EXPECT_NEAR(after.camera.fy(), before.camera.fy(), 1e-9);
  EXPECT_LT((after.Center() - before.Center()).norm(), 1e-9);
}

TEST_F(NavigationTest, OrbitStopsBeforeThePoles) {
  for (int i = 0; i < 200; ++i) navigation_.Orbit(0, 40);
  EXPECT_LT(std::abs(Axis(2).dot(navigation_.up())), 0.9999);
  // Dragged down, the camera has gone up.
  EXPECT_GT(Position().dot(navigation_.up()), 3);
  EXPECT_NEAR((Position() - navigation_.focus()).norm(), 4, 1e-6);
}

// Held a little askew, and looking down: up is still that of the ground, and an orbit turns the
// picture level instead of rolling it.
TEST_F(NavigationTest, AnOrbitTurnsTheHorizonLevel) {
  // Every other view rolls to the left by a tenth, the rest to the right; all look down by 0.6.
  for (auto& [id, view] : ring_.views) {
    const double roll = id % 2 ? 0.1 : -0.1;
    const Eigen::Quaterniond own(Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitZ()) *
                                 Eigen::AngleAxisd(-0.6, Eigen::Vector3d::UnitX()));
    view.cam_from_world.rotation = own * view.cam_from_world.rotation;
    view.cam_from_world.translation = {0, 0, 4};
  }
  // Of an arc alone, in which the mean of the views' own up leans by half a radian.
  for (ViewId id = 4; id <= 8; ++id) ring_.views.erase(id);
  navigation_.SetScene(ring_);
  EXPECT_GT(navigation_.up().dot(Eigen::Vector3d(0, -1, 0)), std::cos(0.03));  // reckoned: 0.017
  double tilt = std::abs(Axis(0).dot(navigation_.up()));
  EXPECT_GT(tilt, 0.05);
  for (int i = 0; i < 60; ++i) {
    navigation_.Orbit(13, i % 2 ? 7 : -5);
    const double now = std::abs(Axis(0).dot(navigation_.up()));
    EXPECT_LE(now, tilt + 1e-9);  // never more askew than before
    tilt = now;
  }
  EXPECT_LT(tilt, 0.005);
}

TEST_F(NavigationTest, AnOrbitAboutAPivotBesideTheAxisKeepsItInPlace) {
  navigation_.Orbit(0, 0);
  const Eigen::Vector3d pivot(0.4, -0.3, 1);
  const PosedCamera before = navigation_.Rendered();
  navigation_.SetPivot(pivot);
  EXPECT_EQ(navigation_.Rendered().Center(), before.Center());
  for (int i = 0; i < 20; ++i) navigation_.Orbit(11, 3);
  const auto first = before.Project(pivot), last = navigation_.Rendered().Project(pivot);
  ASSERT_TRUE(first && last);
  EXPECT_NEAR(first->x(), last->x(), 1e-6);
  EXPECT_NEAR(first->y(), last->y(), 1e-6);
  EXPECT_GT((Position() - before.Center()).norm(), 1);
}

TEST_F(NavigationTest, OrbitKeepsTheHorizonLevel) {
  for (int i = 0; i < 50; ++i) navigation_.Orbit(13, i % 2 ? 7 : -5);
  EXPECT_NEAR(Axis(0).dot(navigation_.up()), 0, 1e-6);
}

TEST_F(NavigationTest, PanMovesWhatIsInFocusWithTheCursor) {
  const auto before = navigation_.Rendered().Project(Eigen::Vector3d::Zero());
  navigation_.Orbit(0, 0);
  const auto free = navigation_.Rendered().Project(Eigen::Vector3d::Zero());
  navigation_.Pan(31, -17);
  const auto after = navigation_.Rendered().Project(Eigen::Vector3d::Zero());
  ASSERT_TRUE(before && free && after);
  EXPECT_NEAR(after->x() - free->x(), 31, 1e-6);
  EXPECT_NEAR(after->y() - free->y(), -17, 1e-6);
}

TEST_F(NavigationTest, LookKeepsWhatIsUnderTheCursor) {
  navigation_.Orbit(0, 0);
  const auto before = navigation_.Rendered().Project(Eigen::Vector3d::Zero());
  navigation_.Look(5, 0);
  const auto after = navigation_.Rendered().Project(Eigen::Vector3d::Zero());
  EXPECT_NEAR(after->x() - before->x(), 5, 0.3);
}

TEST_F(NavigationTest, ZoomNeverPassesTheFocus) {
  const Eigen::Vector3d focus = navigation_.focus();
  for (int i = 0; i < 500; ++i) navigation_.Zoom(1);
  EXPECT_GT((navigation_.Rendered().cam_from_world * focus).z(), 0);
  for (int i = 0; i < 1000; ++i) navigation_.Zoom(-1);
  EXPECT_TRUE(Position().allFinite());
}

TEST_F(NavigationTest, FlySpeedFollowsTimeAndFactor) {
  const Eigen::Vector3d start = Position();
  navigation_.Fly({0, 0, 1}, 0.1, 1);
  const double slow = (Position() - start).norm();
  EXPECT_GT(slow, 0);
  navigation_.Fly({0, 0, 1}, 0.1, 10);
  EXPECT_NEAR((Position() - start).norm(), 11 * slow, 1e-9);
}

TEST_F(NavigationTest, FrameShowsTheWholeSphere) {
  navigation_.SetViewport(300, 700);
  navigation_.Frame({1, 2, 3}, 0.5);
  const PosedCamera camera = navigation_.Rendered();
  for (const Eigen::Vector3d& side : {Axis(0), Axis(1), Eigen::Vector3d(-Axis(0))}) {
    const auto seen = camera.Project(Eigen::Vector3d(1, 2, 3) + 0.5 * side);
    ASSERT_TRUE(seen);
    EXPECT_GE(seen->x(), 0);
    EXPECT_LE(seen->x(), camera.camera.width);
    EXPECT_GE(seen->y(), 0);
    EXPECT_LE(seen->y(), camera.camera.height);
  }
}

TEST_F(NavigationTest, ASpheresPhotoIsLeftForAUsualCamera) {
  const PosedCamera photo{Camera{1, CameraModelId::kEquirectangular, 400, 200, {400, 200}},
                          ring_.views.at(1).cam_from_world};
  navigation_.GoTo(ring_.views.at(1), photo);
  EXPECT_EQ(navigation_.Rendered().camera.width, 800);
  EXPECT_EQ(navigation_.Rendered().camera.height, 400);
  const Eigen::Vector3d from = Position();
  navigation_.Look(0, 0);
  const PosedCamera free = navigation_.Rendered();
  EXPECT_EQ(navigation_.view(), nullptr);
  EXPECT_LT((free.Center() - from).norm(), 1e-9);
  // 800 pixels, 90 degrees.
  EXPECT_NEAR(free.camera.fx(), 400, 1e-9);
  EXPECT_NEAR(free.camera.fy(), 400, 1e-9);
}

TEST_F(NavigationTest, TurntableGoesRoundOnce) {
  const auto cameras = navigation_.Turntable(6, 64, 48);
  ASSERT_EQ(cameras.size(), 6u);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const PosedCamera& camera : cameras) {
    EXPECT_EQ(camera.camera.width, 64);
    EXPECT_NEAR((camera.Center() - navigation_.focus()).norm(), 4, 1e-9);
    sum += camera.Center();
  }
  EXPECT_LT((sum / 6 - navigation_.focus()).norm(), 1e-9);
  EXPECT_NE(navigation_.view(), nullptr);  // the camera itself stays
}

}  // namespace
}  // namespace retint
