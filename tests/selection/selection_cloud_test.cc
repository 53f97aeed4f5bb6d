// SPDX-License-Identifier: BSD-3-Clause
#include "selection/selection_cloud.h"

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "tests/selection/tiny_world.h"

namespace retint {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

class SelectionCloudTest : public ::testing::Test {
 protected:
  TinyWorld world = TinyWorld::Make(3, 0, 0, 1);
  PosedCamera view = world.Posed(1);
  Mask mask = world.BallMask(view);
  DepthMap depth = world.Depth(view);
  CloudOptions options;

  SelectionCloud Make(const CloudOptions& with, CloudSummary* summary = nullptr) const {
    return MakeCloud(view, "view1.png", mask, depth, {}, {}, with, summary);
  }
};

TEST_F(SelectionCloudTest, UnprojectsOntoTheSurface) {
  options.outlier_neighbors = 0;
  CloudSummary summary;
  const SelectionCloud cloud = Make(options, &summary);
  const auto inside = std::count(mask.data.begin(), mask.data.end(), 255);
  EXPECT_EQ(summary.mask_pixels, inside);
  EXPECT_EQ(summary.sampled, std::llround(0.7 * double(inside)));
  EXPECT_EQ(summary.kept, summary.sampled);
  ASSERT_EQ(int64_t(cloud.points.size()), summary.kept);
  double worst_normal = 1, mean_normal = 0;
  for (const auto& point : cloud.points) {
    const Eigen::Vector3d position = point.position.cast<double>();
    // Float depth and float positions: 1e-6 relative of 5 units.
    EXPECT_NEAR((position - world.ball_center).norm(), world.ball_radius, 1e-5);
    const Eigen::Vector3d pixel = *view.Project(position);
    EXPECT_NEAR(pixel.x(), point.x + 0.5, 1e-3);
    EXPECT_NEAR(pixel.y(), point.y + 0.5, 1e-3);
    EXPECT_FLOAT_EQ(point.footprint, float(pixel.z() / std::sqrt(150.0 * 148.0)));
    const Eigen::Vector3d normal = (position - world.ball_center).normalized();
    const double cosine = normal.dot(point.normal.cast<double>());
    mean_normal += cosine / double(cloud.points.size());
    worst_normal = std::min(worst_normal, cosine);
  }
  // Differences over three pixels of a ball 60 pixels wide; the rim, where the surface turns away
  // within a pixel, is the worst.
  EXPECT_GT(mean_normal, 0.995);
  EXPECT_GT(worst_normal, 0.5);
}

TEST_F(SelectionCloudTest, NormalsOfAWallAreExact) {
  std::fill(mask.data.begin(), mask.data.end(), 0);
  for (int y = 0; y < 120; ++y) {
    for (int x = 0; x < 20; ++x) mask(x, y) = 255;
  }
  options.outlier_neighbors = 0;
  for (const auto& point : Make(options).points) {
    // 1/z is affine on a plane, so only float rounding of z is left (3 pixels of 1e-7 against a
    // slope of 1e-3).
    EXPECT_GT(point.normal.cast<double>().dot(world.wall_normal), 0.9999);
  }
}

TEST_F(SelectionCloudTest, NormalsKeepToTheirSideOfADepthEdge) {
  // Two planes facing the camera, a step apart: every normal faces the camera.
  for (int y = 0; y < 120; ++y) {
    for (int x = 0; x < 160; ++x) depth(x, y) = x < 80 ? 4 : 6;
  }
  std::fill(mask.data.begin(), mask.data.end(), 255);
  options.outlier_neighbors = 0;
  const Eigen::Vector3d toward =
      view.cam_from_world.rotation.conjugate() * Eigen::Vector3d(0, 0, -1);
  for (const auto& point : Make(options).points) {
    EXPECT_GT(point.normal.cast<double>().dot(toward), 0.9999) << point.x << "," << point.y;
  }
}

TEST_F(SelectionCloudTest, SamplesTheSameForASeedAndOtherwiseForAnother) {
  const auto first = Make(options), second = Make(options);
  ASSERT_EQ(first.points.size(), second.points.size());
  for (size_t i = 0; i < first.points.size(); ++i) {
    EXPECT_EQ(first.points[i].x, second.points[i].x);
    EXPECT_EQ(first.points[i].position, second.points[i].position);
  }
  options.outlier_neighbors = 0;
  const auto base = Make(options);
  options.seed = 1;
  const auto other = Make(options);
  size_t same = 0;
  for (size_t i = 0; i < base.points.size(); ++i) {
    same += base.points[i].x == other.points[i].x && base.points[i].y == other.points[i].y;
  }
  EXPECT_LT(same, base.points.size() / 2);
}

TEST_F(SelectionCloudTest, RemovesFlyingPixels) {
  // One pixel in a hundred floats between the ball and the camera.
  int flying = 0;
  for (int y = 0; y < 120; ++y) {
    for (int x = 0; x < 160; ++x) {
      if (mask(x, y) && (x + 7 * y) % 100 == 0) depth(x, y) = 2.0f + 0.01f * float(++flying % 7);
    }
  }
  ASSERT_GT(flying, 10);
  options.sample_fraction = 1;
  CloudSummary summary;
  const auto cloud = Make(options, &summary);
  EXPECT_EQ(summary.sampled, summary.mask_pixels);
  for (const auto& point : cloud.points) {
    EXPECT_NEAR((point.position.cast<double>() - world.ball_center).norm(), 1, 1e-4);
  }
  // The factor is strict: about the half above the mean spacing goes.
  EXPECT_GT(summary.kept, summary.sampled / 2);
  EXPECT_LT(summary.kept, summary.sampled - flying + 1);
}

TEST_F(SelectionCloudTest, CarriesColourCoverageAndConfidence) {
  Image image(160, 120, 0.25f);
  Mask valid(160, 120, 255);
  for (int y = 0; y < 60; ++y) {
    for (int x = 0; x < 160; ++x) {
      valid(x, y) = 0;
      image(x, y, 1) = 2.0f;  // renders are not clamped above
    }
  }
  for (auto& value : mask.data) value = value ? 102 : 0;
  const auto cloud = MakeCloud(view, "a", mask, depth, valid, image, options);
  for (const auto& point : cloud.points) {
    EXPECT_FLOAT_EQ(point.coverage, 0.4f);
    EXPECT_FLOAT_EQ(point.confidence, point.y < 60 ? 0.5f : 1.0f);
    EXPECT_EQ(point.color[0], 64);
    EXPECT_EQ(point.color[1], point.y < 60 ? 255 : 64);
  }
}

TEST_F(SelectionCloudTest, LeavesOutPixelsWithoutDepth) {
  for (int x = 0; x < 160; ++x) {
    for (int y = 0; y < 60; ++y)
      depth(x, y) = y % 2 ? 0.0f : std::numeric_limits<float>::infinity();
  }
  for (const auto& point : Make(options).points) {
    EXPECT_GE(point.y, 60);
    EXPECT_TRUE(point.position.allFinite() && point.normal.allFinite());
  }
}

TEST_F(SelectionCloudTest, AnswersBadInput) {
  const auto make = [&](const Mask& m, const DepthMap& d, const Mask& v, const Image& i) {
    return [&, m, d, v, i] { MakeCloud(view, "a.png", m, d, v, i, options); };
  };
  EXPECT_THAT(make(Mask(160, 120), depth, {}, {}),
              ThrowsMessage<InputError>(HasSubstr("the mask of view a.png is empty")));
  EXPECT_THAT(make(Mask(80, 60, 255), depth, {}, {}),
              ThrowsMessage<InputError>(HasSubstr("mask is 80x60, the view is 160x120")));
  EXPECT_THAT(make(mask, DepthMap(80, 60, 1), {}, {}),
              ThrowsMessage<InputError>(HasSubstr("depth map is 80x60")));
  EXPECT_THAT(make(mask, depth, Mask(1, 1), {}),
              ThrowsMessage<InputError>(HasSubstr("validity mask is 1x1")));
  EXPECT_THAT(make(mask, depth, {}, Image(2, 2)),
              ThrowsMessage<InputError>(HasSubstr("image is 2x2")));
  EXPECT_THAT(
      make(mask, DepthMap(160, 120), {}, {}),
      ThrowsMessage<InputError>(HasSubstr("no pixel of the mask of view a.png has a depth")));
  options.sample_fraction = 0;
  EXPECT_THROW(Make(options), OptionError);
  options.sample_fraction = std::nan("");
  EXPECT_THROW(Make(options), OptionError);
}

TEST_F(SelectionCloudTest, KeepsAMaskOfOnePixel) {
  std::fill(mask.data.begin(), mask.data.end(), 0);
  mask(80, 60) = 255;
  EXPECT_EQ(Make(options).points.size(), 1u);
}

TEST_F(SelectionCloudTest, AppendRemapsSources) {
  auto first = MakeCloud(view, "a", mask, depth, {}, {}, options);
  const auto second = MakeCloud(view, "b", mask, depth, {}, {}, options);
  const size_t count = first.points.size();
  Append(first, second);
  Append(first, MakeCloud(view, "a", mask, depth, {}, {}, options));
  EXPECT_EQ(first.sources, (std::vector<std::string>{"a", "b"}));
  ASSERT_EQ(first.points.size(), 3 * count);
  EXPECT_EQ(first.points[0].source, 0);
  EXPECT_EQ(first.points[count].source, 1);
  EXPECT_EQ(first.points[2 * count].source, 0);
}

TEST_F(SelectionCloudTest, EraseClearsWhatTheErasedPixelsSee) {
  const auto cloud = Make(options);
  Mask erase(160, 120);
  for (int y = 0; y < 120; ++y) {
    for (int x = 0; x < 80; ++x) erase(x, y) = 255;
  }
  auto left = cloud;
  const int64_t cleared = Erase(left, view, erase, depth);
  const auto expected = std::count_if(cloud.points.begin(), cloud.points.end(),
                                      [](const auto& point) { return point.x < 80; });
  EXPECT_GT(expected, 0);
  EXPECT_EQ(cleared, expected);
  for (const auto& point : left.points) EXPECT_GE(point.x, 80);

  // Seen through a nearer surface nothing is cleared, without a depth map everything is.
  auto hidden = cloud;
  EXPECT_EQ(Erase(hidden, view, erase, DepthMap(160, 120, 2)), 0);
  EXPECT_EQ(Erase(hidden, view, erase, {}), expected);
  EXPECT_THROW(Erase(hidden, view, Mask(2, 2, 255), {}), InputError);
}

TEST_F(SelectionCloudTest, EraseFromBehindClearsNothingOfTheFront) {
  // From the other side the ball's back is in front: none of the painted points may go.
  PosedCamera behind = view;
  const Eigen::Quaterniond half_turn(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitY()));
  behind.cam_from_world.rotation = half_turn;
  behind.cam_from_world.translation = Eigen::Vector3d(0, 0, 5) - half_turn * world.ball_center;
  options.outlier_neighbors = 0;
  auto cloud = Make(options);
  // The rim is seen from both sides; everything well before it is hidden.
  const Eigen::Vector3d toward = (view.Center() - world.ball_center).normalized();
  const auto well_before = [&](const SelectionPoint& point) {
    return (point.position.cast<double>() - world.ball_center).dot(toward) > 0.3;
  };
  const auto count = [&] {
    return std::count_if(cloud.points.begin(), cloud.points.end(), well_before);
  };
  const auto before = count();
  Erase(cloud, behind, Mask(160, 120, 255), world.Depth(behind));
  EXPECT_EQ(count(), before);
}

}  // namespace
}  // namespace retint
