// SPDX-License-Identifier: BSD-3-Clause
#include "synthetic/synthetic_scene.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "base/error.h"
#include "kernels/common/sh.h"
#include "tests/synthetic/small_scenes.h"

namespace retint {
namespace {

using ::testing::HasSubstr;

Eigen::Vector3d PointAt(const SyntheticScene& scene, const PosedCamera& camera, size_t view, int x,
                        int y) {
  return camera.Unproject({x + 0.5, y + 0.5}, scene.views[view].depth(x, y));
}

Eigen::Vector3d NormalAt(const SyntheticView& view, int x, int y) {
  return {view.normals(x, y, 0), view.normals(x, y, 1), view.normals(x, y, 2)};
}

double Median(std::vector<double> values) {
  EXPECT_FALSE(values.empty());
  if (values.empty()) return NAN;
  std::nth_element(values.begin(), values.begin() + long(values.size() / 2), values.end());
  return values[values.size() / 2];
}

TEST(SyntheticTest, OptionsAreChecked) {
  const auto fault = [](auto change) {
    SyntheticOptions options;
    change(options);
    try {
      options.Check();
    } catch (const OptionError& error) {
      return std::string(error.what());
    }
    return std::string("no error");
  };
  EXPECT_EQ(fault([](SyntheticOptions&) {}), "no error");
  EXPECT_THAT(fault([](auto& o) { o.width = 8; }), HasSubstr("width"));
  EXPECT_THAT(fault([](auto& o) { o.height = 5000; }), HasSubstr("height"));
  EXPECT_THAT(fault([](auto& o) { o.views = 2; }), HasSubstr("photos"));
  EXPECT_THAT(fault([](auto& o) { o.point_noise = -1; }), HasSubstr("noise"));
  EXPECT_THAT(fault([](auto& o) { o.point_noise = NAN; }), HasSubstr("noise"));
  EXPECT_THAT(fault([](auto& o) { o.sparse_points = -1; }), HasSubstr("sparse"));
  EXPECT_THAT(fault([](auto& o) { o.wall_bias = 0.9; }), HasSubstr("bias"));
  EXPECT_THAT(fault([](auto& o) { o.floaters = -3; }), HasSubstr("floaters"));
  EXPECT_THAT(fault([](auto& o) { o.floater_opacity = 1; }), HasSubstr("opacity"));
  EXPECT_THAT(fault([](auto& o) { o.depth_wave = 0.3; }), HasSubstr("wave"));
  EXPECT_THAT(fault([](auto& o) { o.depth_noise = NAN; }), HasSubstr("depth noise"));
  EXPECT_THAT(fault([](auto& o) { o.cloud_scale = 0; }), HasSubstr("scale"));
  EXPECT_THAT(fault([](auto& o) { o.cloud_shift = 2; }), HasSubstr("shift"));
  EXPECT_THAT(fault([](auto& o) {
                o.width = o.height = 2048;
                o.views = 100;
              }),
              HasSubstr("GB of memory"));
  EXPECT_THAT(fault([](auto& o) {
                o.width = o.height = 512;
                o.views = 100;
                o.detail = 3;
              }),
              HasSubstr("less detail"));
}

TEST(SyntheticTest, CancelStops) {
  Monitor monitor;
  monitor.Cancel();
  EXPECT_THROW(MakeSyntheticScene(TinyOptions(), monitor), Cancelled);
}

TEST(SyntheticTest, ViewsAreNamedPosedAndSized) {
  const SyntheticScene& scene = Small();
  ASSERT_EQ(scene.views.size(), 8u);
  ASSERT_EQ(scene.reconstruction.views.size(), 8u);
  EXPECT_EQ(scene.views[3].name, "003.png");
  EXPECT_EQ(scene.object_names[0], "background");
  for (const SyntheticView& view : scene.views) {
    const View* posed = scene.reconstruction.FindView(view.name);
    ASSERT_NE(posed, nullptr);
    const Camera& camera = scene.reconstruction.cameras.at(posed->camera_id);
    EXPECT_EQ(camera.model, CameraModelId::kPinhole);
    for (const auto& [w, h] : {std::pair(view.photo.width, view.photo.height),
                               std::pair(view.depth.width, view.depth.height),
                               std::pair(view.object_ids.width, view.object_ids.height)}) {
      EXPECT_EQ(w, camera.width);
      EXPECT_EQ(h, camera.height);
    }
    EXPECT_NEAR(posed->cam_from_world.rotation.norm(), 1, 1e-12);
  }
}

TEST(SyntheticTest, PhotosAreWellExposed) {
  for (const SyntheticView& view : Small().views) {
    double sum = 0;
    int clipped = 0;
    for (const float value : view.photo.data) {
      ASSERT_GE(value, 0);
      ASSERT_LE(value, 1);
      sum += value;
      clipped += value > 0.99f || value < 0.004f;
    }
    const double mean = sum / double(view.photo.data.size());
    EXPECT_GT(mean, 0.25);
    EXPECT_LT(mean, 0.65);
    EXPECT_LT(clipped, int(view.photo.data.size() / 50));
  }
}

// The room's planes and the ball are known: depth must put points exactly on them. Depth is stored
// in single precision: 1e-6 relative of 4 m is 4e-6; 2e-5 leaves room for the way back.
TEST(SyntheticTest, DepthAndNormalsAreExact) {
  const SyntheticScene& scene = Small();
  const int floor = IdOf(scene, "floor"), paper = IdOf(scene, "wallpaper"),
            ball = IdOf(scene, "ball");
  std::vector<double> paper_z;
  std::vector<Eigen::Vector3d> ball_centers;
  for (size_t v = 0; v < scene.views.size(); ++v) {
    const SyntheticView& view = scene.views[v];
    const PosedCamera camera = CameraOf(scene, v);
    for (int y = 0; y < view.depth.height; ++y) {
      for (int x = 0; x < view.depth.width; ++x) {
        const int id = view.object_ids(x, y);
        ASSERT_LT(size_t(id), scene.object_names.size());
        ASSERT_EQ(id == 0, view.depth(x, y) == 0);
        if (id == 0) continue;
        const Eigen::Vector3d p = PointAt(scene, camera, v, x, y), n = NormalAt(view, x, y);
        ASSERT_NEAR(n.norm(), 1, 1e-5);
        ASSERT_LT(n.dot(p - camera.Center()), 1e-4);
        if (id == floor) {
          ASSERT_NEAR(p.y(), 0, 2e-5);
          ASSERT_NEAR(n.y(), -1, 1e-6);
        } else if (id == paper && n.z() < -0.999999) {
          paper_z.push_back(p.z());
        } else if (id == ball) {
          ball_centers.push_back(p - 0.092 * n);
        }
      }
    }
  }
  // The skirting board stands in front of the wall, the paper itself is one plane.
  const double wall = Median(paper_z);
  for (const double z : paper_z) ASSERT_TRUE(std::abs(z - wall) < 2e-5 || wall - z > 5e-3);
  ASSERT_GT(ball_centers.size(), 500u);
  for (const auto& center : ball_centers) {
    ASSERT_LT((center - ball_centers.front()).norm(), 2e-5);
  }
}

// A pixel's surface point, seen from another view, is either that view's surface with the same id
// or behind it; never in front of everything there. Structures thinner than these coarse pixels (1
// cm) fall between pixel centres, so a few per cent of exceptions belong to the plant, and nothing
// else.
TEST(SyntheticTest, DepthAndIdsAgreeAcrossViews) {
  const SyntheticScene& scene = Small();
  const int plant = IdOf(scene, "plant");
  int64_t checked = 0, floating = 0, matched = 0, same_id = 0;
  for (size_t a = 0; a < scene.views.size(); ++a) {
    const size_t b = (a + 2) % scene.views.size();
    const PosedCamera from = CameraOf(scene, a), to = CameraOf(scene, b);
    const SyntheticView& other = scene.views[b];
    for (int y = 0; y < from.camera.height; ++y) {
      for (int x = 0; x < from.camera.width; ++x) {
        const int id = scene.views[a].object_ids(x, y);
        if (id == 0 || id == plant) continue;
        const auto p = to.Project(PointAt(scene, from, a, x, y));
        if (!p) continue;
        const int px = int(std::floor(p->x())), py = int(std::floor(p->y()));
        if (px < 1 || py < 1 || px + 1 >= other.depth.width || py + 1 >= other.depth.height)
          continue;
        ++checked;
        float nearest = 1e9f;
        bool match = false, same = false;
        for (int k = 0; k < 9; ++k) {
          const int qx = px + k % 3 - 1, qy = py + k / 3 - 1;
          const float z = other.depth(qx, qy);
          nearest = std::min(nearest, z);
          // A pixel further, a slanted surface's depth changes by some per cent.
          const bool close = std::abs(z - p->z()) < 0.04 * p->z();
          match |= close;
          same |= close && other.object_ids(qx, qy) == id;
        }
        floating += p->z() < 0.96 * nearest;
        matched += match;
        same_id += same;
      }
    }
  }
  ASSERT_GT(checked, 50000);
  EXPECT_LT(floating, checked / 500);
  EXPECT_GT(matched, checked / 2);
  EXPECT_GT(same_id, matched * 97 / 100);
}

TEST(SyntheticTest, TracksAndObservationsAgree) {
  const Reconstruction& reconstruction = Small().reconstruction;
  ASSERT_GT(reconstruction.points.size(), 150u);
  size_t elements = 0, matched = 0, unmatched = 0;
  for (const auto& [id, point] : reconstruction.points) {
    EXPECT_EQ(point.id, id);
    ASSERT_GE(point.track.size(), 3u);
    elements += point.track.size();
    double error = 0;
    for (const TrackElement& element : point.track) {
      const View& view = reconstruction.views.at(element.view_id);
      ASSERT_LT(element.observation_idx, view.observations.size());
      const Observation& observation = view.observations[element.observation_idx];
      ASSERT_EQ(observation.point_id, id);
      const auto projected = reconstruction.Posed(view).Project(point.xyz);
      ASSERT_TRUE(projected);
      error += (projected->head<2>() - observation.xy).norm() / double(point.track.size());
    }
    EXPECT_NEAR(error, point.error, 1e-9);
  }
  for (const auto& [id, view] : reconstruction.views) {
    for (const Observation& observation : view.observations) {
      ++(observation.point_id == kInvalidPointId ? unmatched : matched);
    }
  }
  EXPECT_EQ(matched, elements);
  EXPECT_GT(unmatched, 0u);
}

// Residuals of a point fitted to n observations with deviation s have the variance s^2 (1 - 3 /
// 2n). Over hundreds of tracks, the estimate is good to a few percent.
TEST(SyntheticTest, SparsePointsCarryTheNoiseAskedFor) {
  const Reconstruction& reconstruction = Small().reconstruction;
  double sum = 0, expected = 0;
  for (const auto& [id, point] : reconstruction.points) {
    const double n = double(point.track.size());
    expected += 2 * n * 0.5 * 0.5 * (1 - 3 / (2 * n));
    for (const TrackElement& element : point.track) {
      const View& view = reconstruction.views.at(element.view_id);
      const auto projected = reconstruction.Posed(view).Project(point.xyz);
      sum += (projected->head<2>() - view.observations[element.observation_idx].xy).squaredNorm();
    }
  }
  EXPECT_NEAR(sum / expected, 1, 0.15);
}

TEST(SyntheticTest, SparsePointsLieOnTexturedSurfaces) {
  const SyntheticScene& scene = Small();
  const int plain = IdOf(scene, "plain wall"), ball = IdOf(scene, "ball");
  std::vector<double> errors;
  int64_t observed = 0, wrong = 0;
  for (size_t v = 0; v < scene.views.size(); ++v) {
    const SyntheticView& view = scene.views[v];
    const PosedCamera camera = CameraOf(scene, v);
    for (const Observation& o : scene.reconstruction.FindView(view.name)->observations) {
      ASSERT_TRUE(o.xy.x() >= 0 && o.xy.y() >= 0 && o.xy.x() < view.depth.width &&
                  o.xy.y() < view.depth.height);
      if (o.point_id == kInvalidPointId) continue;
      const auto p = camera.Project(scene.reconstruction.points.at(o.point_id).xyz);
      ASSERT_TRUE(p);
      const int x = int(p->x()), y = int(p->y());
      if (!view.depth.Contains(x, y)) continue;
      errors.push_back(std::abs(p->z() - view.depth(x, y)) / p->z());
      ++observed;
      wrong += view.object_ids(x, y) == plain || view.object_ids(x, y) == ball;
    }
  }
  // Half a pixel at these 208 pixels of focal length is 0.3 % sideways; depth along a slanted
  // surface and triangulation over the arc keep it within three times that.
  EXPECT_LT(Median(errors), 0.009);
  // At a silhouette, noise may carry the projection one pixel over.
  EXPECT_LT(wrong * 50, observed);
}

TEST(SyntheticTest, WithoutNoisePointsAreExact) {
  SyntheticOptions options = TinyOptions();
  options.point_noise = 0;
  const SyntheticScene scene = Make(options);
  ASSERT_GT(scene.reconstruction.points.size(), 10u);
  for (const auto& [id, point] : scene.reconstruction.points) EXPECT_LT(point.error, 1e-9);
}

TEST(SyntheticTest, GaussiansAreValidFlatAndOpaque) {
  const GaussianModel& model = Small().model;
  ASSERT_NO_THROW(model.Validate());
  EXPECT_EQ(model.sh_degree, 3);
  const size_t floaters = size_t(SmallOptions().floaters), count = model.NumGaussians();
  ASSERT_GT(count, 10000u);
  size_t flat = 0;
  for (size_t i = 0; i < count; ++i) {
    double norm = 0;
    for (size_t c = 0; c < 4; ++c) norm += std::pow(model.quats_wxyz[4 * i + c], 2);
    ASSERT_NEAR(norm, 1, 1e-5);
    const double opacity = 1 / (1 + std::exp(-model.opacity_logits[i]));
    if (i < count - floaters) {
      ASSERT_GE(opacity, 0.95);
      // Thin along its third axis, but for the plant's stems: beads, as thick as they are wide.
      const float* scales = &model.log_scales[3 * i];
      flat += scales[2] < std::max(scales[0], scales[1]) - std::log(3.0f);
      ASSERT_LE(scales[2], std::max(scales[0], scales[1]));
    } else {
      ASSERT_LE(opacity, 0.1);
    }
  }
  EXPECT_GT(flat, (count - floaters) * 95 / 100);
}

// Evaluated towards a view that sees it, a Gaussian has the photo's colour at its place.
TEST(SyntheticTest, GaussiansMatchPhotosWhereSeen) {
  const SyntheticScene& scene = Small();
  const GaussianModel& model = scene.model;
  const int plain = IdOf(scene, "plain wall");
  const size_t v = 3;
  const PosedCamera camera = CameraOf(scene, v);
  const Eigen::Vector3d center = camera.Center();
  double sum = 0, wall_bias = 0;
  int64_t seen = 0, on_wall = 0;
  for (size_t i = 0; i + size_t(SmallOptions().floaters) < model.NumGaussians(); ++i) {
    const Eigen::Vector3d mean(model.means[3 * i], model.means[3 * i + 1], model.means[3 * i + 2]);
    const auto p = camera.Project(mean);
    if (!p) continue;
    const int x = int(std::floor(p->x())), y = int(std::floor(p->y()));
    if (!scene.views[v].depth.Contains(x, y)) continue;
    const double z = scene.views[v].depth(x, y);
    const bool wall = scene.views[v].object_ids(x, y) == plain;
    if (std::abs(p->z() - z) > (wall ? 0.08 : 0.01) * z) continue;
    const Eigen::Vector3d d = (mean - center).normalized();
    double basis[16];
    ShBasis(3, d.x(), d.y(), d.z(), basis);
    for (size_t c = 0; c < 3; ++c) {
      double color = 0.5;
      for (size_t k = 0; k < 16; ++k) color += basis[k] * model.sh[(i * 16 + k) * 3 + c];
      sum += std::pow(std::max(0.0, color) - scene.views[v].photo(x, y, int(c)), 2) / 3;
    }
    ++seen;
    if (wall) ++on_wall, wall_bias += p->z() / z - 1;
  }
  ASSERT_GT(seen, 5000);
  // Textures change within these coarse pixels; a wrong sign or order in the SH gives 0.3 and more.
  EXPECT_LT(std::sqrt(sum / double(seen)), 0.12);
  ASSERT_GT(on_wall, 100);
  EXPECT_GT(wall_bias / double(on_wall), 0.003);
  EXPECT_LT(wall_bias / double(on_wall), 0.04);
}

TEST(SyntheticTest, GlossDependsOnTheView) {
  const SyntheticScene& scene = Small();
  const GaussianModel& model = scene.model;
  const int ball = IdOf(scene, "ball"), floor = IdOf(scene, "floor");
  const PosedCamera camera = CameraOf(scene, 0);
  double energy[2] = {0, 0};
  int64_t count[2] = {0, 0};
  for (size_t i = 0; i < model.NumGaussians(); ++i) {
    const auto p =
        camera.Project({model.means[3 * i], model.means[3 * i + 1], model.means[3 * i + 2]});
    if (!p) continue;
    const int x = int(std::floor(p->x())), y = int(std::floor(p->y()));
    if (!scene.views[0].depth.Contains(x, y)) continue;
    const int id = scene.views[0].object_ids(x, y);
    if ((id != ball && id != floor) || std::abs(p->z() / scene.views[0].depth(x, y) - 1) > 0.01) {
      continue;
    }
    for (size_t k = 3; k < 48; ++k) energy[id == ball] += std::pow(model.sh[i * 48 + k], 2);
    ++count[id == ball];
  }
  ASSERT_GT(count[0], 50);
  ASSERT_GT(count[1], 50);
  EXPECT_GT(energy[1] / double(count[1]), 2 * energy[0] / double(count[0]));
}

TEST(SyntheticTest, EveryObjectIsSeenWholeSomewhere) {
  SyntheticOptions options = TinyOptions();
  options.views = 24;
  options.sparse_points = 0;
  const SyntheticScene scene = Make(options);
  ASSERT_EQ(scene.whole_views.size(), scene.object_names.size());
  ASSERT_GE(scene.still_life.size(), 5u);
  for (const int object : scene.still_life) {
    SCOPED_TRACE(scene.object_names[size_t(object)]);
    EXPECT_FALSE(scene.whole_views[size_t(object)].empty());
    for (const int v : scene.whole_views[size_t(object)]) {
      const auto& ids = scene.views[size_t(v)].object_ids;
      int64_t inside = 0, border = 0;
      for (int y = 0; y < ids.height; ++y) {
        for (int x = 0; x < ids.width; ++x) {
          if (ids(x, y) != object) continue;
          ++inside;
          border += x == 0 || y == 0 || x + 1 == ids.width || y + 1 == ids.height;
        }
      }
      EXPECT_GT(inside, 0);
      EXPECT_EQ(border, 0);
    }
  }
  EXPECT_TRUE(scene.whole_views[size_t(IdOf(scene, "floor"))].empty());
}

void ExpectSame(const SyntheticScene& a, const SyntheticScene& b) {
  ASSERT_EQ(a.views.size(), b.views.size());
  for (size_t v = 0; v < a.views.size(); ++v) {
    ExpectSameBytes(a.views[v].photo.data, b.views[v].photo.data);
    ExpectSameBytes(a.views[v].depth.data, b.views[v].depth.data);
    ExpectSameBytes(a.views[v].object_ids.data, b.views[v].object_ids.data);
  }
  ExpectSameBytes(a.model.means, b.model.means);
  ExpectSameBytes(a.model.quats_wxyz, b.model.quats_wxyz);
  ExpectSameBytes(a.model.log_scales, b.model.log_scales);
  ExpectSameBytes(a.model.opacity_logits, b.model.opacity_logits);
  ExpectSameBytes(a.model.sh, b.model.sh);
  ASSERT_EQ(a.reconstruction.points.size(), b.reconstruction.points.size());
  for (const auto& [id, point] : a.reconstruction.points) {
    EXPECT_EQ(point.xyz, b.reconstruction.points.at(id).xyz);
    EXPECT_EQ(point.track.size(), b.reconstruction.points.at(id).track.size());
  }
}

TEST(SyntheticTest, SameSeedSameBytesOnAnyNumberOfThreads) {
  const SyntheticScene many = Make(TinyOptions());
  tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  ExpectSame(many, Make(TinyOptions()));
}

TEST(SyntheticTest, SeedChangesTheScene) {
  SyntheticOptions options = TinyOptions();
  options.seed = 5;
  const SyntheticScene a = Make(TinyOptions()), b = Make(options);
  EXPECT_NE(a.views[0].photo.data, b.views[0].photo.data);
  EXPECT_NE(a.reconstruction.views.at(1).cam_from_world.translation,
            b.reconstruction.views.at(1).cam_from_world.translation);
}

}  // namespace
}  // namespace retint
