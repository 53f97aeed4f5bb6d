// SPDX-License-Identifier: BSD-3-Clause
#include "scene/camera.h"

#include <random>
#include <string>
#include <tuple>

#include <gtest/gtest.h>

namespace retint {
namespace {

TEST(CameraModelTest, TableIsColmaps) {
  // Ids are the order, counts the sums of focal lengths, principal point and further parameters in
  // COLMAP's sensor/models.h.
  const std::vector<std::tuple<const char*, int>> kExpected = {
      {"SIMPLE_PINHOLE", 3},
      {"PINHOLE", 4},
      {"SIMPLE_RADIAL", 4},
      {"RADIAL", 5},
      {"OPENCV", 8},
      {"OPENCV_FISHEYE", 8},
      {"FULL_OPENCV", 12},
      {"FOV", 5},
      {"SIMPLE_RADIAL_FISHEYE", 4},
      {"RADIAL_FISHEYE", 5},
      {"THIN_PRISM_FISHEYE", 12},
      {"RAD_TAN_THIN_PRISM_FISHEYE", 16},
      {"SIMPLE_DIVISION", 4},
      {"DIVISION", 5},
      {"SIMPLE_FISHEYE", 3},
      {"FISHEYE", 4},
      {"EUCM", 6},
      {"EQUIRECTANGULAR", 2},
  };
  for (size_t id = 0; id < kExpected.size(); ++id) {
    const auto& [name, num_params] = kExpected[id];
    const CameraModelInfo* by_id = FindCameraModel(static_cast<int>(id));
    ASSERT_NE(by_id, nullptr) << name;
    EXPECT_EQ(by_id->name, name);
    EXPECT_EQ(by_id->num_params, num_params) << name;
    EXPECT_EQ(FindCameraModel(std::string_view(name)), by_id);
  }
}

TEST(CameraModelTest, UnknownModelsAreNull) {
  EXPECT_EQ(FindCameraModel(-1), nullptr);
  EXPECT_EQ(FindCameraModel(18), nullptr);
  EXPECT_EQ(FindCameraModel("pinhole"), nullptr);
  EXPECT_EQ(FindCameraModel(""), nullptr);
}

TEST(CameraTest, IntrinsicsOfBothPinholeModels) {
  const Camera pinhole = Camera::Pinhole(7, 640, 480, 500, 510, 320, 240);
  EXPECT_TRUE(pinhole.IsPinhole());
  EXPECT_EQ(pinhole.fy(), 510);
  Eigen::Matrix3d k;
  k << 500, 0, 320, 0, 510, 240, 0, 0, 1;
  EXPECT_EQ(pinhole.K(), k);

  const Camera simple{1, CameraModelId::kSimplePinhole, 640, 480, {500, 321, 241}};
  EXPECT_TRUE(simple.IsPinhole());
  EXPECT_EQ(simple.fx(), 500);
  EXPECT_EQ(simple.fy(), 500);
  EXPECT_EQ(simple.cx(), 321);
  EXPECT_EQ(simple.cy(), 241);
}

TEST(CameraTest, PixelCentresAreAtHalf) {
  // The centre of the top-left pixel of a camera whose axis passes through it.
  const Camera camera = Camera::Pinhole(1, 10, 10, 100, 100, 0.5, 0.5);
  EXPECT_EQ(camera.ImgFromCam({0, 0, 3}).value(), Eigen::Vector2d(0.5, 0.5));
  // x right, y down.
  EXPECT_GT(camera.ImgFromCam({1, 0, 3})->x(), 0.5);
  EXPECT_GT(camera.ImgFromCam({0, 1, 3})->y(), 0.5);
}

TEST(CameraTest, ProjectionInvertsUnprojection) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0, 1);
  const std::vector<Camera> cameras = {
      Camera::Pinhole(1, 640, 480, 500, 510, 300, 250),
      {2, CameraModelId::kSimplePinhole, 640, 480, {700, 320, 240}},
  };
  for (const Camera& camera : cameras) {
    const PosedCamera posed = {
        camera, {Eigen::Quaterniond(0.5, -0.1, 0.7, 0.2).normalized(), {0.3, -2, 1.5}}};
    for (int i = 0; i < 200; ++i) {
      const Eigen::Vector2d pixel(unit(random) * 640, unit(random) * 480);
      const double z = 0.1 + 20 * unit(random);
      const auto back = posed.Project(posed.Unproject(pixel, z));
      ASSERT_TRUE(back.has_value());
      // Rounding in doubles, of pixels below 1000 at depths that differ 200-fold.
      EXPECT_NEAR(back->x(), pixel.x(), 1e-9);
      EXPECT_NEAR(back->y(), pixel.y(), 1e-9);
      EXPECT_NEAR(back->z(), z, 1e-12 * 100);
    }
  }
}

TEST(CameraTest, BehindTheCameraIsNothing) {
  const Camera camera = Camera::Pinhole(1, 10, 10, 100, 100, 5, 5);
  EXPECT_FALSE(camera.ImgFromCam({0, 0, 0}).has_value());
  EXPECT_FALSE(camera.ImgFromCam({0, 0, -1}).has_value());
  EXPECT_FALSE(camera.ImgFromCam({0, 0, std::nan("")}).has_value());
}

TEST(CameraTest, DistortedModelsDoNotProject) {
  const Camera camera{1, CameraModelId::kSimpleRadial, 640, 480, {500, 320, 240, 0.1}};
  EXPECT_FALSE(camera.IsPinhole());
  EXPECT_FALSE(camera.ImgFromCam({0, 0, 1}).has_value());
  EXPECT_FALSE(camera.CamFromImg({320, 240}).has_value());
}

TEST(PosedCameraTest, CentreIsWhereTheCameraStands) {
  const PosedCamera posed = {Camera::Pinhole(1, 10, 10, 100, 100, 5, 5),
                             {Eigen::Quaterniond(0.9, 0.1, 0.3, -0.2).normalized(), {1, 2, 3}}};
  EXPECT_LT((posed.cam_from_world * posed.Center()).norm(), 1e-14);
}

TEST(PosedCameraTest, IsTheSameByItsLensAndWhereItStands) {
  const PosedCamera posed = {Camera::Pinhole(1, 10, 10, 100, 100, 5, 5),
                             {Eigen::Quaterniond(0.9, 0.1, 0.3, -0.2).normalized(), {1, 2, 3}}};
  PosedCamera wider = posed, turned = posed, moved = posed;
  EXPECT_EQ(wider, posed);
  wider.camera.params[0] = 99;
  turned.cam_from_world.rotation = Eigen::Quaterniond::Identity();
  moved.cam_from_world.translation.z() += 1e-12;
  for (const PosedCamera& other : {wider, turned, moved}) EXPECT_NE(other, posed);
}

}  // namespace
}  // namespace retint
