// SPDX-License-Identifier: BSD-3-Clause
#include "selection/registration.h"

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "tests/selection/tiny_world.h"

namespace retint {
namespace {

using ::testing::HasSubstr;

class RegistrationTest : public ::testing::Test {
 protected:
  static constexpr double kNoise = 0.005;  // of the sparse points, world units
  TinyWorld world = TinyWorld::Make(3, 3000, kNoise, 7);
  PosedCamera view = world.Posed(1);
  Mask mask = world.BallMask(view);
  DepthMap depth = world.Depth(view);
  RegistrationOptions options;

  SelectionCloud Cloud(const DepthMap& from) const {
    return MakeCloud(view, world.view(1).name, mask, from, {}, {}, CloudOptions{});
  }
  RegistrationSummary Run(SelectionCloud& cloud, const DepthMap& map, bool training = true) const {
    return Register(cloud, view, training ? &world.view(1) : nullptr, mask, map,
                    world.reconstruction, options);
  }
  // Root mean square distance of the cloud to the true ball.
  double OffBall(const SelectionCloud& cloud) const {
    double squared = 0;
    for (const auto& point : cloud.points) {
      const double off = (point.position.cast<double>() - world.ball_center).norm() - 1;
      squared += off * off;
    }
    return std::sqrt(squared / double(cloud.points.size()));
  }
  // Root mean square distance of corresponding points.
  static double Apart(const SelectionCloud& a, const SelectionCloud& b) {
    double squared = 0;
    for (size_t i = 0; i < a.points.size(); ++i) {
      squared += (a.points[i].position - b.points[i].position).squaredNorm();
    }
    return std::sqrt(squared / double(a.points.size()));
  }
  SelectionCloud Disturbed(const SelectionCloud& cloud, double scale, double degrees) const {
    const Eigen::Vector3d axis = Eigen::Vector3d(1, 2, -0.5).normalized();
    const Eigen::Quaterniond rotation(Eigen::AngleAxisd(degrees * M_PI / 180, axis));
    SelectionCloud moved = cloud;
    for (auto& point : moved.points) {
      const Eigen::Vector3d from = point.position.cast<double>() - world.ball_center;
      point.position = (world.ball_center + scale * (rotation * from) +
                        (scale == 1 ? 0.0 : 1.0) * Eigen::Vector3d(0.06, -0.04, 0.15))
                           .cast<float>();
      point.normal = (rotation * point.normal.cast<double>()).cast<float>();
      point.footprint *= float(scale);
    }
    return moved;
  }
};

TEST_F(RegistrationTest, RecoversADepthCorrection) {
  // With a = 0.93 and b = 0.004, 1/d = (1/z - b) / a gives z back.
  DepthMap wrong = depth;
  for (auto& z : wrong.data) z = float(0.93 / (1 / z - 0.004));
  SelectionCloud cloud = Cloud(wrong);
  const double before = OffBall(cloud);
  const auto summary = Run(cloud, wrong);
  EXPECT_TRUE(summary.accepted) << summary.BriefReport();
  EXPECT_GT(summary.points_used, 300);
  EXPECT_GT(summary.points_heldout, 60);
  EXPECT_GT(before, 0.08);
  // Hundreds of points with noise kNoise leave an error far below one point's noise. The priors and
  // the similarity's freedom add the rest.
  EXPECT_LT(OffBall(cloud), kNoise) << summary.BriefReport();
  // A point displaced along a slanted normal is missed by more along the ray.
  EXPECT_LT(summary.heldout_after, 1.5 * kNoise);
  EXPECT_LE(summary.heldout_after, summary.heldout_before);
  for (const auto& point : cloud.points) {
    const Eigen::Vector3d in_cam = view.cam_from_world * point.position.cast<double>();
    EXPECT_NEAR(point.footprint, in_cam.z() / std::sqrt(150.0 * 148.0), 1e-3 * point.footprint);
  }
}

TEST_F(RegistrationTest, RecoversADisturbedCloud) {
  const SelectionCloud truth = Cloud(depth);
  for (const double scale : {0.95, 1.05}) {
    for (const bool training : {true, false}) {
      SelectionCloud cloud = Disturbed(truth, scale, 2);
      const double before = Apart(cloud, truth);
      const auto summary = Run(cloud, depth, training);
      EXPECT_TRUE(summary.accepted) << summary.BriefReport();
      EXPECT_GT(before, 0.1);
      // Not only the surface, each point comes back: its source pixel ties it.
      EXPECT_LT(Apart(cloud, truth), 2 * kNoise) << summary.BriefReport();
      EXPECT_LT(summary.heldout_after, 1.5 * kNoise) << summary.BriefReport();
      double worst = 1;
      for (size_t i = 0; i < truth.points.size(); ++i) {
        worst = std::min(worst, double(cloud.points[i].normal.dot(truth.points[i].normal)));
      }
      EXPECT_GT(worst, 0.999);  // within 2.5 degrees, the disturbance undone
    }
  }
}

TEST_F(RegistrationTest, RecoversACloudWithoutSourcePixels) {
  const SelectionCloud truth = Cloud(depth);
  SelectionCloud cloud = Disturbed(truth, 1.03, 1);
  cloud.sources.clear();
  for (auto& point : cloud.points) point.x = point.y = 0;
  const double before = OffBall(cloud);
  const auto summary = Run(cloud, depth);
  EXPECT_TRUE(summary.accepted) << summary.BriefReport();
  // A ball may turn under its points, so the test only checks its surface. The nearest points lie
  // up to a pixel's footprint (0.03) aside, which bends the result.
  EXPECT_LT(OffBall(cloud), 0.2 * before) << summary.BriefReport();
}

TEST_F(RegistrationTest, NeverMakesAnUndisturbedCloudWorse) {
  for (uint64_t seed = 0; seed < 8; ++seed) {
    options.seed = seed;
    SelectionCloud cloud = Cloud(depth);
    const SelectionCloud truth = cloud;
    const auto summary = Run(cloud, depth);
    EXPECT_LE(summary.heldout_after, summary.heldout_before) << summary.BriefReport();
    EXPECT_LT(Apart(cloud, truth), kNoise) << summary.BriefReport();
    if (!summary.accepted) {
      EXPECT_EQ(Apart(cloud, truth), 0);
    }
  }
}

TEST_F(RegistrationTest, OutliersDoNotPull) {
  // A tenth of the points is off by up to the gate.
  int i = 0;
  for (auto& [id, point] : world.reconstruction.points) {
    if (++i % 10 == 0) point.xyz += 0.1 * (point.xyz - view.Center());
  }
  DepthMap wrong = depth;
  for (auto& z : wrong.data) z *= 1.04f;
  SelectionCloud cloud = Cloud(wrong);
  const auto summary = Run(cloud, wrong);
  EXPECT_TRUE(summary.accepted);
  EXPECT_LT(OffBall(cloud), 2 * kNoise) << summary.BriefReport();
}

TEST_F(RegistrationTest, OccludedPointsAreLeftOut) {
  // A free camera has no tracks: points on the wall behind the ball project into the mask too.
  for (int i = 0; i < 400; ++i) {
    const Eigen::Vector3d behind = view.Unproject({60 + i % 20 * 2.0, 45 + i / 20 * 1.5}, 7.5);
    world.reconstruction.points[PointId(100000 + i)].xyz = behind;
  }
  DepthMap wrong = depth;
  for (auto& z : wrong.data) z *= 0.96f;
  SelectionCloud cloud = Cloud(wrong);
  const auto summary = Run(cloud, wrong, false);
  EXPECT_TRUE(summary.accepted);
  EXPECT_LT(OffBall(cloud), kNoise) << summary.BriefReport();
}

TEST_F(RegistrationTest, FewPointsGiveIdentityAndAReason) {
  int left = 0;
  std::erase_if(world.reconstruction.points, [&](const auto&) { return ++left > 5; });
  SelectionCloud cloud = Cloud(depth);
  const SelectionCloud truth = cloud;
  const auto summary = Run(cloud, depth);
  EXPECT_FALSE(summary.accepted);
  EXPECT_THAT(summary.reason, HasSubstr("usable sparse points, 12 needed"));
  EXPECT_EQ(summary.a, 1);
  EXPECT_EQ(summary.world_from_cloud.scale, 1);
  EXPECT_EQ(Apart(cloud, truth), 0);
  EXPECT_THAT(summary.BriefReport(), HasSubstr("not moved, only"));
}

// 1/z' = 1.3/z - 0.06 is right for the ball, but moves points farther than 21.7 behind the
// camera.
TEST_F(RegistrationTest, ThrowsNoPointBehindTheCamera) {
  DepthMap wrong = depth;
  for (auto& z : wrong.data) z = float(1.3 / (1 / z + 0.06));
  for (const double far : {15.0, 25.0}) {
    SelectionCloud cloud = Cloud(wrong);
    cloud.points.front().position = view.Unproject({80, 60}, far).cast<float>();
    const auto summary = Run(cloud, wrong);
    EXPECT_EQ(summary.accepted, far < 20) << summary.BriefReport();
    for (const auto& point : cloud.points) {
      EXPECT_GT((view.cam_from_world * point.position.cast<double>()).z(), 0);
    }
  }
}

TEST_F(RegistrationTest, OtherSourcesStayWhereTheyAre) {
  DepthMap wrong = depth;
  for (auto& z : wrong.data) z *= 1.04f;
  SelectionCloud cloud = Cloud(wrong);
  SelectionCloud other =
      MakeCloud(world.Posed(0), world.view(0).name, world.BallMask(world.Posed(0)),
                world.Depth(world.Posed(0)), {}, {}, CloudOptions{});
  const size_t count = cloud.points.size();
  Append(cloud, other);
  EXPECT_TRUE(Run(cloud, wrong).accepted);
  for (size_t i = 0; i < other.points.size(); ++i) {
    EXPECT_EQ(cloud.points[count + i].position, other.points[i].position);
  }
}

TEST_F(RegistrationTest, IsDeterministic) {
  DepthMap wrong = depth;
  for (auto& z : wrong.data) z *= 1.02f;
  SelectionCloud first = Cloud(wrong), second = Cloud(wrong);
  EXPECT_EQ(Run(first, wrong).BriefReport(), Run(second, wrong).BriefReport());
  EXPECT_EQ(Apart(first, second), 0);
}

TEST_F(RegistrationTest, AnswersBadInput) {
  SelectionCloud cloud = Cloud(depth);
  EXPECT_THROW(
      Register(cloud, view, nullptr, Mask(3, 3, 255), depth, world.reconstruction, options),
      InputError);
  EXPECT_THROW(Register(cloud, view, nullptr, mask, DepthMap(3, 3), world.reconstruction, options),
               InputError);
  options.heldout_fraction = 1;
  EXPECT_THROW(Run(cloud, depth), OptionError);
  options = {};
  SelectionCloud empty;
  EXPECT_FALSE(Run(empty, depth).accepted);
}

}  // namespace
}  // namespace retint
