// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/scene/lens_picture.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "colmap_io/photo_pixels.h"
#include "scene/camera_projection.h"

namespace retint {
namespace {

const Camera kSphere{1, CameraModelId::kEquirectangular, 240, 120, {240, 120}};
// 240 pixels at 70 a radian: 196 degrees wide.
const Camera kFisheye{1, CameraModelId::kOpenCVFisheye, 240, 180, {70, 70, 120, 90, 0, 0, 0, 0}};
const Camera kRadial{1, CameraModelId::kSimpleRadial, 240, 180, {220, 121, 89, -0.15}};

// A color of every direction, without a step anywhere.
Eigen::Vector3f ColorOf(const Eigen::Vector3d& ray) {
  const Eigen::Vector3d d = ray.normalized();
  return (Eigen::Vector3d::Constant(0.5) + 0.4 * d).cast<float>();
}

Image Look(const PosedCamera& camera) {
  Image image(camera.camera.width, camera.camera.height);
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const Eigen::Vector3d ray = camera.Unproject({x + 0.5, y + 0.5}, 1) - camera.Center();
      const Eigen::Vector3f color = ColorOf(ray);
      std::copy_n(color.data(), 3, &image.data[image.Index(x, y)]);
    }
  }
  return image;
}

class LensPictureTest : public testing::TestWithParam<Camera> {
 protected:
  std::shared_ptr<const Undistortion> lens_ =
      std::make_shared<const Undistortion>(Undistort(GetParam()));
};

TEST_P(LensPictureTest, ShowsWhatThePhotoSees) {
  const Rigid3d pose{Eigen::Quaterniond(0.9, 0.1, -0.3, 0.2).normalized(), {1, 2, 3}};
  for (const double scale : {1.0, 0.5, 1.7}) {
    const Camera photo = Resized(GetParam(), int(std::lround(GetParam().width * scale)),
                                 int(std::lround(GetParam().height * scale)));
    const LensPicture picture(lens_, photo.width, photo.height);
    ASSERT_EQ(picture.Faces(pose).size(), lens_->faces.size());
    const Image seen = DrawThrough(&picture, {photo, pose}, Look);
    ASSERT_EQ(seen.width, photo.width);
    ASSERT_EQ(seen.height, photo.height);
    const CameraProjection projection(photo);
    float worst = 0;
    int64_t rays = 0;
    for (int y = 0; y < photo.height; ++y) {
      for (int x = 0; x < photo.width; ++x) {
        const float* at = &seen.data[seen.Index(x, y)];
        const auto ray = projection.CamFromImg({x + 0.5, y + 0.5});
        if (!ray) {
          EXPECT_EQ(at[0], 0) << x << " " << y;
          continue;
        }
        ++rays;
        const Eigen::Vector3f expected = ColorOf(pose.rotation.conjugate() * *ray);
        for (int c = 0; c < 3; ++c) worst = std::max(worst, std::abs(at[c] - expected[c]));
      }
    }
    EXPECT_GT(rays, int64_t(photo.width) * photo.height / 2);
    // A pixel, of at most 3 degrees, changes colors by 0.021; positions may be off by a sixteenth
    // of it, and at a face's border half a pixel is held.
    EXPECT_LT(worst, 0.01F) << scale;
  }
}

TEST_P(LensPictureTest, IsWhatFilesHold) {
  Reconstruction model;
  model.cameras[1] = GetParam();
  View view;
  view.id = 1, view.name = "a.png", view.camera_id = 1;
  model.views[1] = view;
  const PhotoPixels pixels(&model);
  const DistortedPhoto& photo = pixels.photos().front();
  const LensPicture picture(lens_, GetParam().width, GetParam().height);
  // Each face has another gray, to show how faces are blended.
  std::vector<Mask> faces;
  for (size_t f = 0; f < lens_->faces.size(); ++f) {
    const Camera& camera = lens_->faces[f].camera;
    faces.emplace_back(camera.width, camera.height, uint8_t(40 + 30 * f));
  }
  const Mask expected = pixels.ToPhoto(photo, faces), bent = picture.Bent(faces);
  ASSERT_EQ(bent.data.size(), expected.data.size());
  int worst = 0;
  for (size_t i = 0; i < bent.data.size(); ++i) {
    worst = std::max(worst, std::abs(int(bent.data[i]) - int(expected.data[i])));
  }
  // Positions are off by about a sixteenth of a pixel, of the four in which a face fades by 150.
  EXPECT_LE(worst, 8);
}

INSTANTIATE_TEST_SUITE_P(Lenses, LensPictureTest, testing::Values(kSphere, kFisheye, kRadial),
                         [](const auto& lens) {
                           return std::string(
                               FindCameraModel(static_cast<int>(lens.param.model))->name);
                         });

TEST(LensPicture, OfWideLensesTakesSeveralFaces) {
  EXPECT_EQ(Undistort(kSphere).faces.size(), 6u);
  EXPECT_GT(Undistort(kFisheye).faces.size(), 1u);
  EXPECT_EQ(Undistort(kRadial).faces.size(), 1u);
}

TEST(LensPicture, WithoutALensACameraIsDrawnAsItIs) {
  const PosedCamera camera{Camera::Pinhole(0, 20, 10, 15, 15, 10, 5), {}};
  const Image seen = DrawThrough(nullptr, camera, Look);
  EXPECT_EQ(seen.data, Look(camera).data);
}

}  // namespace
}  // namespace retint
