// SPDX-License-Identifier: BSD-3-Clause
#include "colmap_io/photo_pixels.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "scene/camera_projection.h"
#include "tests/colmap_io/tiny_model.h"

namespace retint {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

using Id = CameraModelId;

// Colors and depths of a room about the camera: smooth functions of the direction.
Eigen::Vector3f ColorOf(const Eigen::Vector3d& direction) {
  const Eigen::Vector3d d = direction.normalized();
  return {float(0.5 + 0.4 * std::sin(3 * d.x() + d.y())), float(0.5 + 0.4 * std::cos(2 * d.y())),
          float(0.5 + 0.4 * d.z() * d.x())};
}

Image PhotoOfRoom(const Camera& camera) {
  const CameraProjection projection(camera);
  Image photo(camera.width, camera.height);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const auto ray = projection.CamFromImg({x + 0.5, y + 0.5});
      if (!ray) continue;
      const Eigen::Vector3f color = ColorOf(*ray);
      std::copy_n(color.data(), 3, &photo.data[photo.Index(x, y)]);
    }
  }
  return photo;
}

Image ViewOfRoom(const PinholeFace& face) {
  Image view(face.camera.width, face.camera.height);
  for (int y = 0; y < view.height; ++y) {
    for (int x = 0; x < view.width; ++x) {
      const Eigen::Vector2d flat = face.camera.CamFromImg({x + 0.5, y + 0.5}).value();
      const Eigen::Vector3f color =
          ColorOf(face.face_from_photo.conjugate() * Eigen::Vector3d(flat.x(), flat.y(), 1));
      std::copy_n(color.data(), 3, &view.data[view.Index(x, y)]);
    }
  }
  return view;
}

Reconstruction ModelWith(const Camera& camera) {
  Reconstruction model = TinyModel();
  model.cameras[4] = camera;
  model.cameras[4].id = 4;
  // The camera's own middle is seen of point 9, a corner is a stray.
  model.views[3].observations[0].xy = {0.5 * camera.width + 1, 0.5 * camera.height + 2};
  model.views[3].observations.push_back({{0.01, 0.01}, kInvalidPointId});
  return model;
}

class PhotoPixelsTest : public ::testing::TestWithParam<Camera> {};

TEST_P(PhotoPixelsTest, CarriesPicturesBothWays) {
  const Camera& camera = GetParam();
  Reconstruction model = ModelWith(camera);
  const PhotoPixels pixels(&model);
  ASSERT_EQ(pixels.photos().size(), 1u);
  const DistortedPhoto& photo = pixels.photos()[0];
  EXPECT_EQ(pixels.FindPhoto("sub/b c.png"), &photo);
  const Image seen = PhotoOfRoom(camera);
  std::vector<Image> views;
  for (size_t f = 0; f < photo.faces.size(); ++f) {
    ASSERT_EQ(pixels.PhotoOf(photo.faces[f]), &photo);
    views.push_back(ViewOfRoom(photo.lens->faces[f]));
    const Image undistorted = pixels.ToView(photo.faces[f], seen);
    const Mask reach = pixels.Reach(photo.faces[f]);
    float worst = 0;
    for (size_t i = 0; i < reach.data.size(); ++i) {
      for (size_t c = 0; c < 3 && reach.data[i] > 0; ++c) {
        worst = std::max(worst, std::abs(undistorted.data[3 * i + c] - views[f].data[3 * i + c]));
      }
    }
    // Colors change by some 0.02 a pixel; at the photo's border they are held for half a pixel.
    EXPECT_LT(worst, 0.02F) << "face " << f;
  }
  const Image composed = pixels.ToPhoto(photo, views);
  float worst = 0;
  for (size_t i = 0; i < seen.data.size(); ++i) {
    worst = std::max(worst, std::abs(composed.data[i] - seen.data[i]));
  }
  EXPECT_LT(worst, 0.01F);
}

TEST_P(PhotoPixelsTest, KeepsTheModelConsistent) {
  Reconstruction model = ModelWith(GetParam());
  const Reconstruction before = model;
  const PhotoPixels pixels(&model);
  EXPECT_EQ(model.views.at(2).observations.size(), 3u);
  EXPECT_EQ(model.cameras.at(1), before.cameras.at(1));
  const CameraProjection projection(GetParam());
  size_t tracked = 0;
  for (const auto& [id, point] : model.points) {
    for (const TrackElement& element : point.track) {
      const View& view = model.views.at(element.view_id);
      const Observation& observation = view.observations.at(element.observation_idx);
      EXPECT_EQ(observation.point_id, id);
      ++tracked;
      const DistortedPhoto* photo = pixels.PhotoOf(element.view_id);
      if (!photo) continue;
      const auto face = size_t(std::find(photo->faces.begin(), photo->faces.end(), view.id) -
                               photo->faces.begin());
      const Eigen::Vector2d flat =
          model.cameras.at(view.camera_id).CamFromImg(observation.xy).value();
      const Eigen::Vector3d ray = photo->lens->faces[face].face_from_photo.conjugate() *
                                  Eigen::Vector3d(flat.x(), flat.y(), 1);
      EXPECT_LT((projection.ImgFromCam(ray).value() - before.views.at(3).observations[0].xy).norm(),
                1e-6);
    }
  }
  EXPECT_EQ(tracked, 3u);
  // A face stands where the photo does and looks where its own frame says.
  const DistortedPhoto& photo = pixels.photos()[0];
  for (size_t f = 0; f < photo.faces.size(); ++f) {
    const Eigen::Vector3d point(0.3, -1, 4);
    const Eigen::Vector3d in_photo = before.views.at(3).cam_from_world * point;
    const Eigen::Vector3d in_face = model.views.at(photo.faces[f]).cam_from_world * point;
    EXPECT_LT((photo.lens->faces[f].face_from_photo * in_photo - in_face).norm(), 1e-12);
  }
}

TEST_P(PhotoPixelsTest, MasksKeepTheirShape) {
  const Camera& camera = GetParam();
  Reconstruction model = ModelWith(camera);
  const PhotoPixels pixels(&model);
  const DistortedPhoto& photo = pixels.photos()[0];
  Mask brush(camera.width, camera.height);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const double dx = x - 0.7 * camera.width, dy = y - 0.5 * camera.height;
      brush(x, y) = dx * dx + dy * dy < 900 ? 255 : 0;
    }
  }
  std::vector<Mask> faces;
  for (const ViewId face : photo.faces) faces.push_back(pixels.ToView(face, brush));
  const Mask back = pixels.ToPhoto(photo, faces);
  int both = 0, either = 0;
  for (size_t i = 0; i < brush.data.size(); ++i) {
    both += brush.data[i] >= 128 && back.data[i] >= 128;
    either += brush.data[i] >= 128 || back.data[i] >= 128;
  }
  // A disc of 2827 pixels, whose border of 188 may move by a small part of a pixel.
  EXPECT_GT(double(both) / either, 0.98);
}

INSTANTIATE_TEST_SUITE_P(
    Lenses, PhotoPixelsTest,
    ::testing::Values(Camera{4, Id::kSimpleRadial, 240, 180, {220, 121, 89, -0.15}},
                      Camera{4, Id::kOpenCV, 240, 180, {220, 222, 121, 89, -0.2, 0.05, 1e-3, 1e-3}},
                      Camera{4, Id::kOpenCVFisheye, 240, 180, {80, 80, 120, 90, 0.01, 0, 0, 0}},
                      Camera{4, Id::kEquirectangular, 360, 180, {360, 180}}),
    [](const auto& lens) {
      return std::string(FindCameraModel(static_cast<int>(lens.param.model))->name);
    });

TEST(PhotoPixelsTest, DepthOfASphereIsTheDistance) {
  Reconstruction model = ModelWith({4, Id::kEquirectangular, 180, 90, {180, 90}});
  const PhotoPixels pixels(&model);
  const DistortedPhoto& photo = pixels.photos()[0];
  std::vector<DepthMap> faces;  // of a sphere of radius 2 about the camera
  for (const PinholeFace& face : photo.lens->faces) {
    DepthMap depth(face.camera.width, face.camera.height);
    for (int y = 0; y < depth.height; ++y) {
      for (int x = 0; x < depth.width; ++x) {
        const Eigen::Vector2d flat = face.camera.CamFromImg({x + 0.5, y + 0.5}).value();
        depth(x, y) = float(2 / std::sqrt(1 + flat.squaredNorm()));
      }
    }
    faces.push_back(std::move(depth));
  }
  const DepthMap depth = pixels.DepthToPhoto(photo, faces);
  // The nearest pixel's depth: half a pixel of 1 / 29 beside it, where z changes by that at most.
  for (const float value : depth.data) ASSERT_NEAR(value, 2, 0.04);
}

TEST(PhotoPixelsTest, CamerasOfEqualLensesShareThem) {
  Reconstruction model = TinyModel();
  model.cameras[1] = {1, Id::kSimpleRadial, 64, 48, {50, 32, 24, -0.1}};
  model.cameras[4] = {4, Id::kSimpleRadial, 64, 48, {50, 32, 24, -0.1}};
  const PhotoPixels pixels(&model);
  ASSERT_EQ(pixels.photos().size(), 3u);
  EXPECT_EQ(pixels.photos()[0].lens, pixels.photos()[1].lens);
}

TEST(PhotoPixelsTest, FacesAreCalledByTheirPhoto) {
  Reconstruction model = ModelWith({4, Id::kEquirectangular, 180, 90, {180, 90}});
  const PhotoPixels pixels(&model);
  EXPECT_EQ(model.views.size(), 8u);
  EXPECT_EQ(model.FindView("sub/b c.png"), nullptr);
  ASSERT_NE(model.FindView("sub/b c.png@front"), nullptr);
  EXPECT_EQ(model.FindView("sub/b c.png@front")->id, 3u);
  EXPECT_NE(model.FindView("sub/b c.png@down"), nullptr);
}

TEST(PhotoPixelsTest, NamesTheCameraThatCannotBeUsed) {
  Reconstruction model = ModelWith({4, Id::kSimpleRadial, 64, 48, {50, 32, 24, -20}});
  EXPECT_THAT([&] { PhotoPixels{&model}; },
              ThrowsMessage<InputError>(HasSubstr("camera 4 (SIMPLE_RADIAL): its distortion")));
}

}  // namespace
}  // namespace retint
