// SPDX-License-Identifier: BSD-3-Clause
// Paint on photos with several pinhole views: the ball before the wall, with nothing on the other
// side.
#include <memory>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "colmap_io/image_io.h"
#include "editing/compare_pictures.h"
#include "editing/edit_session.h"
#include "opening/photo_paint.h"
#include "opening/scene_check.h"
#include "scene/camera_projection.h"
#include "scene/mask_pixels.h"
#include "tests/selection/tiny_gaussians.h"
#include "tests/support/data.h"

namespace retint {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr int kWidth = 320, kHeight = 160;

class WidePhoto : public testing::Test {
 protected:
  WidePhoto() : session_(Open({})) {
    select_.depth_method = "gaussian";  // exact enough here; stereo is tested where it belongs
  }

  std::unique_ptr<EditSession> Open(const std::filesystem::path& photos) const {
    Workspace workspace;
    workspace.root = "tiny";
    workspace.image_folder = photos;
    workspace.reconstruction = world_.reconstruction;
    const Camera pinhole = world_.reconstruction.cameras.at(1);
    const CameraProjection sphere(sphere_);
    workspace.reconstruction.cameras[1] = sphere_;
    for (auto& [id, view] : workspace.reconstruction.views) {
      for (Observation& one : view.observations) {
        one.xy = sphere.ImgFromCam(pinhole.CamFromImg(one.xy).value().homogeneous()).value();
      }
    }
    workspace.UndistortViews();
    SessionOptions options;
    options.backend = "cpu";
    return std::make_unique<EditSession>(std::move(workspace), TinyGaussians(world_).model,
                                         options);
  }

  // The ball in the first photo.
  Mask Ball() const {
    Mask mask(kWidth, kHeight);
    const CameraProjection projection(sphere_);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const auto ray = projection.CamFromImg({x + 0.5, y + 0.5});
        if (!ray || ray->z() < 0.5) continue;
        const Eigen::Vector2d flat = ray->hnormalized();
        const PosedCamera pinhole = world_.Posed(0);
        const auto hit = world_.Cast(pinhole, pinhole.camera.ImgFromCam(*ray).value());
        mask(x, y) = hit && hit->on_ball && flat.norm() < 1 ? 255 : 0;
      }
    }
    return mask;
  }
  // A spot directly behind the camera, without any surface.
  static void PaintBehind(Mask* mask) {
    for (int y = kHeight / 2 - 6; y < kHeight / 2 + 6; ++y) {
      for (int x = 0; x < 8; ++x) (*mask)(x, y) = 255;
    }
  }
  PaintedView On(Mask mask) const {
    const Workspace& workspace = session_->scene().workspace();
    const DistortedPhoto& photo = *workspace.photo_pixels->FindPhoto(world_.view(0).name);
    return {photo.name, PosedPhoto(workspace, photo), std::move(mask)};
  }
  std::string Face(const std::string& face) const { return world_.view(0).name + "@" + face; }

  TinyWorld world_ = TinyWorld::Make(3, 400, 0.002, 7);
  Camera sphere_{1, CameraModelId::kEquirectangular, kWidth, kHeight, {kWidth, kHeight}};
  std::unique_ptr<EditSession> session_;
  SelectOptions select_;
  Monitor monitor_;
};

TEST_F(WidePhoto, WhatShowsNoSurfaceIsLeftOut) {
  Mask mask = Ball();
  const SelectionResult ball = session_->selection().Select({On(mask)}, select_, monitor_);
  ASSERT_FALSE(ball.cloud.points.empty());
  ASSERT_EQ(ball.painted.size(), 1u);
  PaintBehind(&mask);
  const SelectionResult both = session_->selection().Select({On(mask)}, select_, monitor_);
  ASSERT_EQ(both.painted.size(), 2u);
  EXPECT_EQ(both.painted[0].view, Face("front"));
  EXPECT_EQ(both.painted[1].view, Face("back"));
  EXPECT_EQ(both.painted[1].cloud.sampled, 0);
  EXPECT_THAT(both.painted[1].depth_reason, HasSubstr("has a depth"));
  ASSERT_EQ(both.depths.size(), 2u);
  EXPECT_EQ(both.depths[1].depth.width, both.depths[0].depth.width);
  EXPECT_THAT(both.cloud.sources, ElementsAre(Face("front")));
  ASSERT_EQ(both.cloud.points.size(), ball.cloud.points.size());
  for (size_t i = 0; i < ball.cloud.points.size(); ++i) {
    EXPECT_EQ(both.cloud.points[i].position, ball.cloud.points[i].position);
  }
  // And a whole round works.
  const RegionSelection selection =
      session_->selection().SelectRound(nullptr, {On(mask), {}}, select_, {}, monitor_);
  EXPECT_EQ(selection.masks.size(), session_->scene().reconstruction().views.size());
}

TEST_F(WidePhoto, PaintWithoutAnySurfaceIsRefused) {
  Mask mask(kWidth, kHeight);
  PaintBehind(&mask);
  EXPECT_THAT([&] { session_->selection().Select({On(mask)}, select_, monitor_); },
              ThrowsMessage<NoDepthError>(HasSubstr("has a depth")));
}

TEST_F(WidePhoto, AViewThatLooksAtNothingIsNoSignOfAnotherFrame) {
  Monitor monitor;
  const SceneCheck check = CheckScene(session_->scene(), monitor, {});
  ASSERT_EQ(check.comparisons.size(), 3u) << "one a photo";
  EXPECT_GT(check.median_coverage, SceneCheckOptions().min_coverage);
  EXPECT_EQ(check.mismatch, "");
}

// Photos beyond the splat, here white, say nothing about its frame.
TEST_F(WidePhoto, ASplatOfAPartOfTheSphereIsNoSignOfAnotherFrame) {
  const TempFolder folder;
  const auto check = [&](float brightness) {
    const Workspace& workspace = session_->scene().workspace();
    RenderRequest request;
    request.alpha = true;
    for (int i = 0; i < 3; ++i) {
      const DistortedPhoto& photo = *workspace.photo_pixels->FindPhoto(world_.view(i).name);
      std::vector<Image> faces;
      for (const ViewId face : photo.faces) {
        const View& view = workspace.reconstruction.views.at(face);
        RenderOutput output =
            session_->scene().renderer().Render(workspace.reconstruction.Posed(view), request);
        for (size_t p = 0; p < output.rgb.data.size(); ++p) {
          const float alpha = output.alpha.data[p / 3];
          output.rgb.data[p] = brightness * output.rgb.data[p] + 1 - alpha;
        }
        faces.push_back(std::move(output.rgb));
      }
      WritePng(folder / photo.name, workspace.photo_pixels->ToPhoto(photo, faces));
    }
    return CheckScene(Open(folder.path())->scene(), monitor_, {});
  };
  const SceneCheck same = check(1);
  EXPECT_GT(same.median_psnr, 25);
  EXPECT_EQ(same.mismatch, "");
  EXPECT_THAT(check(0.2F).mismatch, HasSubstr("disagree"));
}

TEST_F(WidePhoto, APictureIsComparedAsItWasRead) {
  OpenScene& scene = session_->scene();
  const Workspace& workspace = scene.workspace();
  const DistortedPhoto& photo = *workspace.photo_pixels->FindPhoto(world_.view(0).name);
  std::vector<Image> faces;
  for (const ViewId face : photo.faces) {
    faces.push_back(scene.Render(scene.reconstruction().views.at(face), scene.original().sh));
  }
  Image painted = workspace.photo_pixels->ToPhoto(photo, faces);
  const Mask ball = Ball();
  for (size_t p = 0; p < ball.data.size(); ++p) {
    if (IsInside(ball.data[p])) painted.data[3 * p] *= 0.5F;
  }
  const TempFolder folder;
  const std::filesystem::path file = folder / "painted.png";
  WritePng(file, painted);
  RegionSelection selection;
  selection.masks = session_->scene().pictures().ToViews({{photo.name, ball}});
  const auto compared = [&](bool gone) {
    ColorOperation op = ColorOperation::Picture({{photo.name, file, {}}});
    ReadPictures(op, workspace);
    if (gone) std::filesystem::remove(file);
    ComparePictures(op, {}, selection, scene, scene.original().sh);
    return op;
  };
  const ColorOperation kept = compared(false);
  EXPECT_GT(kept.Get("explained")[0], 0.9F);
  EXPECT_EQ(compared(true), kept) << "the file is not looked at again";
}

TEST_F(WidePhoto, PicturesAreFoundByTheirNameAndTheirViews) {
  const Pictures pictures = session_->scene().pictures();
  ASSERT_EQ(pictures.all().size(), 3u);
  const UserPicture& first = pictures.all().front();
  EXPECT_EQ(first.name, world_.view(0).name);
  ASSERT_EQ(first.faces.size(), 6u);
  EXPECT_EQ(pictures.Find(first.name), &first);
  EXPECT_EQ(pictures.Find(Face("left")), &first);
  EXPECT_EQ(pictures.Find("another.png"), nullptr);
  EXPECT_EQ(&pictures.Of(*first.faces[4]), &first);
  const auto groups = pictures.Groups();
  ASSERT_EQ(groups.size(), 3u);
  EXPECT_EQ(groups[0].name, first.name);
  EXPECT_EQ(groups[0].views, first.faces);
  // If views were requested, each is a picture.
  const Pictures views(session_->scene().workspace(), Pixels::kPinhole);
  EXPECT_EQ(views.Groups().size(), 18u);
  EXPECT_EQ(views.Find(first.name), nullptr);
  ASSERT_NE(views.Find(Face("left")), nullptr);
  EXPECT_EQ(views.Find(Face("left"))->faces.size(), 1u);
}

}  // namespace
}  // namespace retint
