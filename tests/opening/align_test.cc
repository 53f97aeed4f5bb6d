// SPDX-License-Identifier: BSD-3-Clause
#include "opening/align.h"

#include <gtest/gtest.h>

#include "scene/transform.h"
#include "splat_io/splat_io.h"
#include "tests/support/data.h"

namespace retint {
namespace {

TEST(Align, APhotoThatIsNoWholeNumberOfPixelsKeepsItsScale) {
  const Camera camera = Camera::Pinhole(1, 107, 60, 96, 84, 54, 30);
  Image photo(camera.width, camera.height);
  for (int y = 0; y < photo.height; ++y) {
    for (int x = 0; x < photo.width; ++x) photo(x, y, 0) = float(x);
  }
  const ReducedPhoto reduced = Reduced(photo, camera, 12);
  EXPECT_EQ(reduced.photo.width, 8);
  EXPECT_EQ(reduced.photo.height, 5);
  EXPECT_FLOAT_EQ(reduced.photo(7, 4, 0), 7 * 12 + 5.5F) << "the mean of 84 to 95";
  EXPECT_EQ(reduced.camera.width, 8);
  EXPECT_EQ(reduced.camera.fx(), 8);
  EXPECT_EQ(reduced.camera.fy(), 7);
  EXPECT_EQ(reduced.camera.cx(), 4.5);
  EXPECT_EQ(reduced.camera.cy(), 2.5);
}

// Truth by damage: a similarity is put on a splat, and taken off again.
TEST(Align, WithoutPhotosTheSparsePointsSettleTheTurn) {
  RETINT_REQUIRE_DATA("flower");
  Monitor monitor;
  const TempFolder no_photos;
  const Workspace workspace = Workspace::Open(DataPath("flower"), no_photos.path());
  GaussianModel model = ReadSplat(DataPath("flower") / "splat.ply");
  const Sim3d damage{
      1.7, Eigen::Quaterniond(Eigen::AngleAxisd(0.6, Eigen::Vector3d(1, 2, -1).normalized())),
      Eigen::Vector3d(4, -1, 2)};
  Transform(damage, model);
  const AlignResult result = Align(CreateBackend("cpu"), workspace, model, {}, {}, monitor);
  EXPECT_EQ(result.source, "points");
  EXPECT_TRUE(std::isnan(result.psnr_after));
  const Sim3d left = Compose(result.world_from_splat, damage);
  const double degrees = left.rotation.angularDistance(Eigen::Quaterniond::Identity()) * 180 / M_PI;
  EXPECT_LT(degrees, 0.05);  // the points' places alone leave 0.36
  EXPECT_NEAR(left.scale, 1, 0.005);
}

}  // namespace
}  // namespace retint
