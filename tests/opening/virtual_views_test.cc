// SPDX-License-Identifier: BSD-3-Clause
// A splat without photos: where its scene is, which views are placed, and work on them.
#include "opening/virtual_views.h"

#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "base/files.h"
#include "colmap_io/sparse.h"
#include "kernels/common/sh.h"
#include "opening/scene_shape.h"
#include "scene/transform.h"
#include "tests/colmap_io/tiny_model.h"
#include "tests/saving/saved_scene.h"

namespace retint {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;

// Coefficients as after gradient descent from zero: the basis at the directions from which views
// saw a Gaussian, times its color there.
void TrainFrom(const std::vector<Vector3d>& eyes, GaussianModel& model, TestRandom& random) {
  const size_t block = size_t(model.NumShCoeffs()) * 3;
  for (size_t g = 0; g < model.NumGaussians(); ++g) {
    const Vector3d mean = Eigen::Map<const Eigen::Vector3f>(&model.means[3 * g]).cast<double>();
    for (const Vector3d& eye : eyes) {
      const Vector3d d = (mean - eye).normalized();
      double basis[16];
      ShBasis(model.sh_degree, d.x(), d.y(), d.z(), basis);
      for (int c = 0; c < 3; ++c) {
        const double error = random.Uniform(-0.1, 0.1);
        for (int k = 1; k < model.NumShCoeffs(); ++k) {
          model.sh[g * block + size_t(3 * k + c)] += float(error * basis[k]);
        }
      }
    }
  }
}

// A ball's opaque surface of Gaussians around `center`, and floaters far away.
GaussianModel Ball(const Vector3d& center, double radius, int count, int degree = 0) {
  GaussianModel model;
  const int floaters = count / 50;
  model.Resize(size_t(count + floaters), degree);
  TestRandom random(5);
  for (int g = 0; g < count; ++g) {
    const double z = 1 - (2 * g + 1.0) / count, angle = g * 2.39996;
    const double ring = std::sqrt(1 - z * z);
    const Vector3d normal(ring * std::cos(angle), ring * std::sin(angle), z);
    SetGaussian(model, size_t(g), center + radius * normal, 2.0 * radius / std::sqrt(count), 4);
  }
  for (int g = count; g < count + floaters; ++g) {
    const Vector3d far(random.Uniform(20, 60), random.Uniform(-60, 60), random.Uniform(-60, 60));
    SetGaussian(model, size_t(g), center + radius * far, 0.1 * radius, 0);
  }
  for (float& value : model.sh) value = float(random.Uniform(-0.01, 0.01));
  return model;
}

Workspace Place(const GaussianModel& model, int views) {
  VirtualViewOptions options;
  options.views = views;
  options.width = 240, options.height = 180;
  Monitor monitor;
  return PlaceViews(CreateBackend("cpu"), model, options, monitor);
}

TEST(SceneShape, FloatersAreNotTheScene) {
  const Vector3d center(3, -7, 11);
  const SceneShape shape = MeasureShape(Ball(center, 2, 1000));
  EXPECT_LT((shape.center - center).norm(), 0.1);
  // Every Gaussian of the surface is as far from the center.
  EXPECT_NEAR(shape.inner_radius, 2, 0.1);
  EXPECT_NEAR(shape.outer_radius, 2, 0.1);
  EXPECT_NEAR(shape.up.norm(), 1, 1e-9);
  GaussianModel nothing;
  EXPECT_THROW(MeasureShape(nothing), InputError);
}

// A floor of flat Gaussians that was seen from above, in the axes of several tools.
TEST(SceneShape, UpIsTheSideFromWhichTheFloorWasSeen) {
  for (const Vector3d& up : {Vector3d(0, -1, 0), Vector3d(0, 0, 1), Vector3d(0, 1, 0),
                             Vector3d(0.17, -0.97, 0.17).normalized()}) {
    GaussianModel model;
    constexpr int kSide = 24;
    model.Resize(kSide * kSide, 3);
    const Eigen::Quaterniond turn = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), up);
    for (int g = 0; g < kSide * kSide; ++g) {
      const Vector3d flat(g % kSide - kSide / 2.0, g / kSide - kSide / 2.0, 0);
      SetGaussian(model, size_t(g), turn * flat, 0.7, 3);
      model.log_scales[size_t(3 * g + 2)] = std::log(0.01F);
      const Eigen::Vector4d q(turn.w(), turn.x(), turn.y(), turn.z());
      for (int k = 0; k < 4; ++k) model.quats_wxyz[size_t(4 * g + k)] = float(q[k]);
    }
    TestRandom random(9);
    std::vector<Vector3d> eyes;
    for (int k = 0; k < 12; ++k) {
      eyes.push_back(turn * Vector3d(20 * std::cos(k * 0.52), 20 * std::sin(k * 0.52), 14));
    }
    TrainFrom(eyes, model, random);
    EXPECT_GT(MeasureShape(model).up.dot(up), 0.999) << up.transpose();
  }
}

TEST(SceneShape, DirectionalColorTellsWhereTheTrainingViewsWere) {
  GaussianModel model;
  model.Resize(40, 3);
  TestRandom random(2);
  std::vector<Vector3d> eyes;
  for (int k = 0; k < 20; ++k) {
    eyes.emplace_back(random.Uniform(-1, 1), random.Uniform(-1, 1), -5);
  }
  TrainFrom(eyes, model, random);
  double front = 0, back = 0;
  for (size_t g = 0; g < 40; ++g) {
    front += TrainedShare(3, &model.sh[g * 48], Vector3d::UnitZ());
    back += TrainedShare(3, &model.sh[g * 48], -Vector3d::UnitZ());
  }
  EXPECT_GT(front / 40, 4);  // well above the mean of the sphere, which is 1
  // The basis up to degree 3 at the opposite direction is a third of that at the direction, and its
  // square counts. The directions and signs of 20 views spread that.
  EXPECT_LT(back, front / 3);
  EXPECT_EQ(TrainedShare(0, &model.sh[0], Vector3d::UnitZ()), 1);
}

TEST(PlaceViews, EveryGaussianOfAnObjectIsSeenFromSeveralSides) {
  const Vector3d center(3, -7, 11);
  const GaussianModel model = Ball(center, 2, 1000);
  const Workspace workspace = Place(model, 24);
  EXPECT_TRUE(workspace.has_virtual_views);
  const Reconstruction& views = workspace.reconstruction;
  ASSERT_EQ(views.views.size(), 24u);
  int seldom = 0;
  for (size_t g = 0; g < 1000; ++g) {
    const Vector3d mean = Eigen::Map<const Eigen::Vector3f>(&model.means[3 * g]).cast<double>();
    int seen = 0;
    for (const auto& [id, view] : views.views) {
      const PosedCamera posed = views.Posed(view);
      const auto pixel = posed.Project(mean);
      // In the picture, on the side of the ball that faces the camera.
      seen += pixel && pixel->x() > 0 && pixel->y() > 0 && pixel->x() < 240 && pixel->y() < 180 &&
              (mean - center).dot(posed.Center() - mean) > 0;
    }
    seldom += seen < 3;
  }
  // Straight from below, where nobody stands, some are seen at the rim only.
  EXPECT_LT(seldom, 80);
  for (const auto& [id, view] : views.views) {
    const double distance = (views.Posed(view).Center() - center).norm();
    EXPECT_GT(distance, 2.2) << view.name << " is inside";
    EXPECT_LT(distance, 20) << view.name;
  }
}

TEST(PlaceViews, ThePointsLieOnGaussiansAndTheirTracksOnPixels) {
  const GaussianModel model = Ball({0, 0, 0}, 1, 600);
  const Reconstruction views = Place(model, 12).reconstruction;
  ASSERT_GT(views.points.size(), 100u);
  for (const auto& [id, point] : views.points) {
    ASSERT_GE(point.track.size(), 2u);
    EXPECT_NEAR(point.xyz.norm(), 1, 1e-5);
    for (const TrackElement& element : point.track) {
      const View& view = views.views.at(element.view_id);
      const Observation& seen = view.observations.at(element.observation_idx);
      ASSERT_EQ(seen.point_id, id);
      const auto pixel = views.Posed(view).Project(point.xyz);
      ASSERT_TRUE(pixel);
      EXPECT_LT((pixel->head<2>() - seen.xy).norm(), 1e-9);
      // The side that faces the camera: the other lies two radii deeper.
      EXPECT_GT(point.xyz.dot(views.Posed(view).Center() - point.xyz), -0.1);
    }
  }
}

TEST(PlaceViews, TheSameSplatGetsTheSameViews) {
  const GaussianModel model = Ball({1, 2, 3}, 1, 300);
  const Reconstruction a = Place(model, 6).reconstruction, b = Place(model, 6).reconstruction;
  for (const auto& [id, view] : a.views) {
    EXPECT_EQ(view.cam_from_world.translation, b.views.at(id).cam_from_world.translation);
  }
}

TEST(PlaceViews, AreKeptForTheSameGaussians) {
  const TempFolder cache;
  VirtualViewOptions options;
  options.views = 5, options.width = 160, options.height = 120;
  int steps = 0;
  Monitor monitor([&](const Progress&) { ++steps; });
  const auto place = [&](const GaussianModel& model) {
    steps = 0;
    return PlaceViewsOnce(CreateBackend("cpu"), model, options, cache.path(), monitor);
  };
  GaussianModel model = Ball({1, 2, 3}, 1, 300);
  const Workspace first = place(model);
  const int all = steps;
  const Workspace again = place(model);
  EXPECT_EQ(steps, 1) << "of " << all;
  EXPECT_GT(all, 20);
  ExpectSame(again.reconstruction, first.reconstruction);
  EXPECT_TRUE(again.has_virtual_views && again.warnings.empty() && again.root.empty());
  // Other options, other colors: other views.
  options.views = 6;
  EXPECT_EQ(place(model).reconstruction.views.size(), 6u);
  EXPECT_EQ(steps, all);
  options.views = 5;
  model.sh[7] += 0.01F;
  place(model);
  EXPECT_EQ(steps, all);
  // Damaged views, and views that cannot be kept, are placed again.
  for (const auto& entry : std::filesystem::directory_iterator(cache.path())) {
    std::filesystem::resize_file(entry.path() / "images.bin", 30);
  }
  ExpectSame(place(Ball({1, 2, 3}, 1, 300)).reconstruction, first.reconstruction);
  EXPECT_EQ(steps, all);
  WriteFile(cache / "file", "");
  ExpectSame(PlaceViewsOnce(CreateBackend("cpu"), Ball({1, 2, 3}, 1, 300), options, cache / "file",
                            monitor)
                 .reconstruction,
             first.reconstruction);
}

// A room's walls, seen from inside, look the same from outside: only the directional color tells.
TEST(PlaceViews, ARoomIsSeenFromInside) {
  GaussianModel room = Ball({0, 0, 0}, 4, 800, 3);
  TestRandom random(4);
  std::vector<Vector3d> eyes;
  for (int k = 0; k < 12; ++k) {
    eyes.emplace_back(1.5 * std::cos(k * 0.5), random.Uniform(-0.5, 0.5), 1.5 * std::sin(k * 0.5));
  }
  TrainFrom(eyes, room, random);
  const Reconstruction views = Place(room, 16).reconstruction;
  for (const auto& [id, view] : views.views) {
    EXPECT_LT(views.Posed(view).Center().norm(), 4) << view.name;
  }
}

TEST(PlaceViews, HostileSplatsGetViewsOrASentence) {
  GaussianModel one;
  one.Resize(1, 0);
  SetGaussian(one, 0, {1e6, 0, 0}, 1e-3, 5);
  EXPECT_EQ(Place(one, 4).reconstruction.views.size(), 4u);
  GaussianModel spread;
  spread.Resize(200, 0);
  TestRandom random(1);
  for (size_t g = 0; g < 200; ++g) {
    SetGaussian(spread, g, Vector3d(random.Uniform(-1e7, 1e7), random.Uniform(-1e7, 1e7), 0), 1e5,
                random.Uniform(-20, 20));
  }
  EXPECT_EQ(Place(spread, 4).reconstruction.views.size(), 4u);
  GaussianModel invisible;
  invisible.Resize(5, 0);
  for (float& logit : invisible.opacity_logits) logit = -50;
  EXPECT_THROW(Place(invisible, 4), InputError);
  VirtualViewOptions options;
  options.views = 1;
  EXPECT_THROW(options.Check(), OptionError);
}

class SplatAlone : public ::testing::Test {
 protected:
  SplatAlone() {
    WriteSplat(folder_ / "ball.ply", Ball({0, 0, 0}, 1, 400, 1));
    options_.backend = "cpu";
    options_.views = 5;
    setenv("RETINT_CACHE", (folder_ / "cache").c_str(), 1);
  }
  std::unique_ptr<EditSession> Open() {
    return EditSession::Open({}, folder_ / "ball.ply", options_, monitor_);
  }

  TempFolder folder_;
  SessionOptions options_;
  Monitor monitor_;
};

TEST_F(SplatAlone, ViewsAreKeptInTheCache) {
  Open();
  const auto kept = std::filesystem::directory_iterator(folder_ / "cache")->path();
  EXPECT_THAT(kept.filename().string(), ::testing::StartsWith("views-"));
  // Uses the views that it finds there.
  Reconstruction model = ReadReconstruction(kept);
  model.views.erase(model.views.begin());
  std::filesystem::remove(kept / "images.bin");
  WriteReconstructionBinary(kept, model);
  EXPECT_EQ(Open()->scene().reconstruction().views.size(), 4u);
}

TEST_F(SplatAlone, RendersServeAsPhotos) {
  const auto session = Open();
  EXPECT_EQ(session->scene().reconstruction().views.size(), 5u);
  const View& view = *session->scene().train_views().front();
  EXPECT_FALSE(session->scene().workspace().HasPhoto(view));
  EXPECT_EQ(session->scene().Picture(view).data,
            session->scene().Render(view, session->scene().original().sh).data);
}

TEST_F(SplatAlone, ASessionSavedOverHoldsItsViewsOnce) {
  const auto session = Open();
  for (int save = 0; save < 2; ++save) {
    SessionWriter(folder_ / "a.retint").Write(TakeSnapshot(*session), monitor_);
  }
  int views = 0;
  for (const auto& part : std::filesystem::directory_iterator(folder_ / "a.retint")) {
    views += part.path().filename().string().starts_with("views-") ? 1 : 0;
  }
  EXPECT_EQ(views, 1);
}

TEST_F(SplatAlone, ASavedSessionKeepsItsViewsToTheBit) {
  const auto session = Open();
  std::map<std::string, Mask> masks;
  const PosedCamera posed =
      session->scene().reconstruction().Posed(*session->scene().train_views().front());
  masks[session->scene().train_views().front()->name] =
      Mask(posed.camera.width, posed.camera.height, 255);
  session->store().Add("all", masks,
                       std::vector<float>(session->scene().original().NumGaussians(), 1.0F),
                       ColorEdit::Tint({1, 0, 0}), monitor_);
  SessionWriter(folder_ / "a.retint").Write(TakeSnapshot(*session), monitor_);
  SessionOptions others = options_;
  others.views = 9;  // the session has its own
  const OpenedSession opened = OpenSession(folder_ / "a.retint", others, monitor_);
  const Reconstruction& saved = opened.session->scene().reconstruction();
  ASSERT_EQ(saved.views.size(), 5u);
  EXPECT_EQ(saved.cameras, session->scene().reconstruction().cameras);
  for (const auto& [id, view] : session->scene().reconstruction().views) {
    EXPECT_EQ(saved.views.at(id).name, view.name);
    EXPECT_EQ(saved.views.at(id).cam_from_world.translation, view.cam_from_world.translation);
    EXPECT_EQ(saved.views.at(id).cam_from_world.rotation.coeffs(),
              view.cam_from_world.rotation.coeffs());
  }
  EXPECT_EQ(opened.session->store().regions().regions.size(), 1u);
  // And once more, to another place.
  SessionWriter(folder_ / "b.retint").Write(TakeSnapshot(*opened.session), monitor_);
  std::filesystem::remove_all(folder_ / "a.retint");
  EXPECT_EQ(OpenSession(folder_ / "b.retint", others, monitor_)
                .session->scene()
                .reconstruction()
                .views.size(),
            5u);
  for (const auto& part : std::filesystem::directory_iterator(folder_ / "b.retint")) {
    if (!part.path().filename().string().starts_with("views-")) continue;
    std::filesystem::resize_file(part.path() / "images.bin", 30);
  }
  EXPECT_THAT([&] { OpenSession(folder_ / "b.retint", others, monitor_); },
              ::testing::ThrowsMessage<InputError>(HasSubstr("images.bin: truncated")));
}

// A splat in another frame: cameras come to it, and it keeps its bits.
TEST(WorldFromSplat, CamerasAreMovedAndTheSplatIsNot) {
  const TempFolder folder;
  const TinyScene scene(3);
  WriteTinyScene(scene, folder.path());
  const Sim3d splat_from_world{
      0.4, Eigen::Quaterniond(0.3, -0.6, 0.5, 0.4).normalized(), {1, 2, 3}};
  GaussianModel moved = scene.model;
  Transform(splat_from_world, moved);
  WriteSplat(folder / "moved.ply", moved);
  SessionOptions options;
  options.backend = "cpu";
  options.world_from_splat = splat_from_world.Inverse();
  Monitor monitor;
  const auto session = EditSession::Open(folder / "ws", folder / "moved.ply", options, monitor);
  EXPECT_EQ(session->scene().original().means, moved.means);
  const auto plain = OpenTinyScene(folder.path());
  const Image a =
      session->scene().Render(*session->scene().train_views()[2], session->scene().original().sh);
  const Image b =
      plain->scene().Render(*plain->scene().train_views()[2], plain->scene().original().sh);
  double squares = 0;
  for (size_t i = 0; i < a.data.size(); ++i) squares += std::pow(double(a.data[i] - b.data[i]), 2);
  // As in the test of Transform(): single precision.
  EXPECT_LT(std::sqrt(squares / double(a.data.size())), 2e-3);
  // It comes back with the session.
  SessionWriter(folder / "s.retint").Write(TakeSnapshot(*session), monitor);
  SessionOptions others;
  others.backend = "cpu";
  const OpenedSession opened = OpenSession(folder / "s.retint", others, monitor);
  EXPECT_EQ(
      opened.session->scene().reconstruction().views.begin()->second.cam_from_world.translation,
      session->scene().reconstruction().views.begin()->second.cam_from_world.translation);
}

}  // namespace
}  // namespace retint
