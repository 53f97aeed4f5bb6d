// SPDX-License-Identifier: BSD-3-Clause
#include "scene/undistortion.h"

#include <cmath>
#include <set>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "scene/camera_projection.h"

namespace retint {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;
using ::testing::ThrowsMessage;

using Id = CameraModelId;

Camera Make(Id model, std::vector<double> params, int width = 320, int height = 240) {
  return {1, model, width, height, std::move(params)};
}

// Every pixel of the photo that has a ray lies in a face, and comes back from there.
void ExpectCovered(const Camera& photo, const Undistortion& lens) {
  const CameraProjection projection(photo);
  std::vector<PixelMap> faces, photos;
  for (size_t f = 0; f < lens.faces.size(); ++f) {
    faces.push_back(FaceFromPhoto(lens, f));
    ASSERT_EQ(faces.back().width, photo.width);
    ASSERT_EQ(faces.back().height, photo.height);
  }
  int seen = 0;
  for (int y = 0; y < photo.height; y += 3) {
    for (int x = 0; x < photo.width; x += 3) {
      const auto ray = projection.CamFromImg({x + 0.5, y + 0.5});
      if (!ray) continue;
      ++seen;
      int covering = 0;
      for (size_t f = 0; f < lens.faces.size(); ++f) {
        const float* at = &faces[f].xy[2 * (size_t(y) * size_t(photo.width) + size_t(x))];
        if (std::isnan(at[0])) continue;
        ++covering;
        const PinholeFace& face = lens.faces[f];
        const Eigen::Vector2d flat = face.camera.CamFromImg({at[0], at[1]}).value();
        const auto back = projection.ImgFromCam(face.face_from_photo.conjugate() *
                                                Eigen::Vector3d(flat.x(), flat.y(), 1));
        ASSERT_TRUE(back.has_value());
        // Maps hold floats: a few units in the last place of some hundreds.
        EXPECT_LT((*back - Eigen::Vector2d(x + 0.5, y + 0.5)).norm(), 1e-3);
      }
      ASSERT_GE(covering, 1) << x << " " << y;
      Eigen::Vector2d pixel;
      ASSERT_GE(BestFace(lens, *ray, &pixel), 0);
    }
  }
  EXPECT_GT(seen, 320 * 240 / 9 / 3);
}

TEST(UndistortionTest, OneFaceCoversALensOfUsualWidth) {
  for (const Camera& photo : {Make(Id::kSimpleRadial, {250, 161, 119, -0.2}),
                              Make(Id::kSimpleRadial, {250, 161, 119, 0.3}),
                              Make(Id::kOpenCV, {250, 255, 161, 119, -0.28, 0.09, 0.001, -0.002}),
                              Make(Id::kOpenCVFisheye, {200, 201, 161, 119, 0.01, 0.005, 0, 0})}) {
    const Undistortion lens = Undistort(photo);
    ASSERT_EQ(lens.faces.size(), 1u);
    EXPECT_TRUE(lens.faces[0].name.empty());
    EXPECT_TRUE(lens.faces[0].face_from_photo.isApprox(Eigen::Quaterniond::Identity()));
    EXPECT_FALSE(lens.DepthIsDistance());
    // The photo's resolution in its middle at least.
    EXPECT_GE(lens.faces[0].camera.fx(), photo.params[0] - 1e-9);
    EXPECT_LE(lens.faces[0].camera.fx(), 1.5 * photo.params[0] + 1e-9);
    ExpectCovered(photo, lens);
  }
}

TEST(UndistortionTest, WideLensesTakeTheFacesThatTheySee) {
  // 320 pixels at 90 a radian are 204 degrees wide, the corners 254: nothing is straight behind.
  const Camera photo = Make(Id::kSimpleFisheye, {90, 160, 120});
  const Undistortion lens = Undistort(photo);
  std::set<std::string> names;
  for (const PinholeFace& face : lens.faces) names.insert(face.name);
  EXPECT_EQ(names, (std::set<std::string>{"front", "right", "left", "up", "down"}));
  EXPECT_TRUE(lens.DepthIsDistance());
  ExpectCovered(photo, lens);
}

TEST(UndistortionTest, ASphereTakesAWholeCube) {
  const Camera photo = Make(Id::kEquirectangular, {320, 160}, 320, 160);
  const Undistortion lens = Undistort(photo);
  EXPECT_EQ(lens.faces.size(), 6u);
  ExpectCovered(photo, lens);
  // The right face looks to the right of the middle.
  Eigen::Vector2d pixel;
  const int right = BestFace(lens, Eigen::Vector3d(1, 0.1, 0), &pixel);
  EXPECT_EQ(lens.faces[size_t(right)].name, "right");
  const Camera& face = lens.faces[size_t(right)].camera;
  EXPECT_NEAR(pixel.x(), face.cx(), 1e-9);
  EXPECT_NEAR(pixel.y(), face.cy() + 0.1 * face.fy(), 1e-9);
  const int up = BestFace(lens, Eigen::Vector3d(0.1, -1, 0), &pixel);
  EXPECT_EQ(lens.faces[size_t(up)].name, "up");
  EXPECT_GT(pixel.x(), face.cx());
}

TEST(UndistortionTest, FacesFadeTowardTheirBorders) {
  const Undistortion cube = Undistort(Make(Id::kEquirectangular, {320, 160}, 320, 160));
  const auto side = float(cube.faces[0].camera.width);
  EXPECT_EQ(FaceWeight(cube, 0, side / 2, side / 2), 1);
  EXPECT_EQ(FaceWeight(cube, 0, 0.05F * side, side / 2), 1);
  EXPECT_NEAR(FaceWeight(cube, 0, side / 2, 0.975F * side), 0.5F, 1e-4);
  EXPECT_GT(FaceWeight(cube, 0, 0, side / 2), 0);
  EXPECT_LT(FaceWeight(cube, 0, 0, side / 2), 0.001F);
  // Rays that no other face shows have full weight.
  const Undistortion single = Undistort(Make(Id::kSimpleRadial, {250, 161, 119, -0.2}));
  EXPECT_EQ(FaceWeight(single, 0, 0, 0), 1);
}

TEST(UndistortionTest, CornersBeyondTheFoldAreLeftOut) {
  // The fold lies at a bent radius of 0.6086: 152 pixels, less than the corners' 200.
  const Camera photo = Make(Id::kSimpleRadial, {250, 160, 120, -0.4});
  const Undistortion lens = Undistort(photo);
  ASSERT_EQ(lens.faces.size(), 1u);
  const PixelMap map = FaceFromPhoto(lens, 0);
  EXPECT_TRUE(std::isnan(map.xy[0]));
  EXPECT_FALSE(std::isnan(map.xy[2 * (120 * 320 + 160)]));
  ExpectCovered(photo, lens);
}

TEST(UndistortionTest, FoldedPicturesAreRefused) {
  EXPECT_THAT(
      [] {
        Undistort(Make(Id::kSimpleRadial, {250, 160, 120, -9}));
      },
      ThrowsMessage<InputError>(HasSubstr("folds the picture: only ")));
}

// The fold encloses 35 % and 32 % of the picture.
TEST(UndistortionTest, AThirdOfThePixelsMustHaveARay) {
  EXPECT_NO_THROW(Undistort(Make(Id::kSimpleRadial, {250, 160, 120, -1.08})));
  EXPECT_THROW(Undistort(Make(Id::kSimpleRadial, {250, 160, 120, -1.17})), InputError);
}

TEST(UndistortionTest, IsDescribed) {
  EXPECT_EQ(DescribeCamera(Camera::Pinhole(1, 64, 48, 50, 50, 32, 24)), "PINHOLE 64x48");
  EXPECT_THAT(DescribeCamera(Make(Id::kSimpleRadial, {250, 160, 120, -0.1})),
              StartsWith("SIMPLE_RADIAL 320x240, undistorted to "));
  EXPECT_EQ(DescribeCamera(Make(Id::kEquirectangular, {320, 160}, 320, 160)),
            "EQUIRECTANGULAR 320x160, shown as 6 pinhole views of 114x114");
}

}  // namespace
}  // namespace retint
