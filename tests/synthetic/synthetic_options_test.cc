// SPDX-License-Identifier: BSD-3-Clause
// The effect of options on a synthetic scene: colors of objects, flaws, positions of cameras.
#include <cmath>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "tests/synthetic/small_scenes.h"

namespace retint {
namespace {

TEST(SyntheticTest, RepaintsObjectsAndNothingElse) {
  SyntheticOptions options = TinyOptions();
  const SyntheticScene before = Make(options);
  Image8 green(3, 2);  // pasted on the box
  for (size_t p = 0; p < green.NumPixels(); ++p) green.data[3 * p + 1] = 255;
  options.albedo = {{"ball", {0.1f, 0.2f, 0.9f}}, {"box", {}, green}};
  const SyntheticScene after = Make(options);
  const int ball = IdOf(before, "ball"), box = IdOf(before, "box");
  double red = 0, blue = 0;
  int green_pixels = 0;
  for (size_t v = 0; v < before.views.size(); ++v) {
    const SyntheticView &x = before.views[v], &y = after.views[v];
    EXPECT_EQ(x.object_ids.data, y.object_ids.data);
    EXPECT_EQ(x.depth.data, y.depth.data);
    for (int row = 1; row + 1 < x.photo.height; ++row) {
      for (int column = 1; column + 1 < x.photo.width; ++column) {
        int of_ball = 0, of_box = 0;
        for (int k = 0; k < 9; ++k) {
          const int id = x.object_ids(column + k % 3 - 1, row + k / 3 - 1);
          of_ball += id == ball;
          of_box += id == box;
        }
        green_pixels += of_box == 9 && y.photo(column, row, 1) > 2 * y.photo(column, row, 0) &&
                        y.photo(column, row, 1) > 2 * y.photo(column, row, 2);
        for (int c = 0; c < 3; ++c) {
          const float old = x.photo(column, row, c), now = y.photo(column, row, c);
          // A pixel's rays stay inside it, so only those at an object can meet it.
          if (of_ball == 0 && of_box == 0) {
            EXPECT_EQ(old, now);
          }
          if (of_ball == 9 && c == 0) red += double(now) - double(old);
          if (of_ball == 9 && c == 2) blue += double(now) - double(old);
        }
      }
    }
  }
  EXPECT_LT(red, 0);
  EXPECT_GT(blue, 0);
  EXPECT_GT(green_pixels, 20);

  options.albedo = {{"elephant", {0, 0, 1}}};
  EXPECT_THROW(options.Check(), OptionError);
  options.albedo = {{"ball", {0, 0, 2}}};
  EXPECT_THROW(options.Check(), OptionError);
  options.albedo = {{"ball", {0, 0, 1}}, {"ball", {0, 1, 0}}};
  EXPECT_THROW(options.Check(), OptionError);
}

TEST(SyntheticTest, DetailMakesFinerGaussiansOfTheSamePhotos) {
  SyntheticOptions options = TinyOptions();
  options.floaters = 0;
  const SyntheticScene plain = Make(options);
  options.detail = 2;
  const SyntheticScene fine = Make(options);
  for (size_t v = 0; v < plain.views.size(); ++v) {
    ExpectSameBytes(plain.views[v].photo.data, fine.views[v].photo.data);
    ExpectSameBytes(plain.views[v].depth.data, fine.views[v].depth.data);
  }
  // Half the size in both directions is four times as many; where texture is even, discs are as
  // large as they may be in pixels.
  EXPECT_GT(double(fine.model.NumGaussians()), 2.5 * double(plain.model.NumGaussians()));

  options.detail = 0;
  EXPECT_THROW(options.Check(), OptionError);
}

// Everything but the Gaussians' places and sizes.
void ExpectSamePhotosAndColors(const SyntheticScene& a, const SyntheticScene& b) {
  ASSERT_EQ(a.views.size(), b.views.size());
  for (size_t v = 0; v < a.views.size(); ++v) {
    ExpectSameBytes(a.views[v].photo.data, b.views[v].photo.data);
    ExpectSameBytes(a.views[v].depth.data, b.views[v].depth.data);
    ExpectSameBytes(a.views[v].object_ids.data, b.views[v].object_ids.data);
  }
  ExpectSameBytes(a.model.quats_wxyz, b.model.quats_wxyz);
  ExpectSameBytes(a.model.sh, b.model.sh);
}

Eigen::Vector3d MiddleOfCameras(const SyntheticScene& scene) {
  Eigen::Vector3d eye = Eigen::Vector3d::Zero();
  for (size_t v = 0; v < scene.views.size(); ++v) {
    eye += CameraOf(scene, v).Center() / double(scene.views.size());
  }
  return eye;
}

// The factor on each Gaussian's distance from `eye`. Asserts that the Gaussian stayed on its line
// of sight, and that its size has the same factor.
std::vector<double> Stretches(const SyntheticScene& before, const SyntheticScene& after,
                              size_t floaters) {
  const Eigen::Vector3d eye = MiddleOfCameras(before);
  std::vector<double> stretches;
  const auto mean = [](const GaussianModel& model, size_t i) {
    return Eigen::Vector3d(model.means[3 * i], model.means[3 * i + 1], model.means[3 * i + 2]);
  };
  EXPECT_EQ(before.model.NumGaussians(), after.model.NumGaussians());
  for (size_t i = 0; i + floaters < before.model.NumGaussians(); ++i) {
    const Eigen::Vector3d p = mean(before.model, i) - eye, q = mean(after.model, i) - eye;
    stretches.push_back(q.norm() / p.norm());
    // Positions are floats of up to 5 m, in steps of 5e-7 m.
    EXPECT_LT((q - stretches.back() * p).norm(), 2e-6);
    // Of sizes and distances, each rounded to a float.
    const double grown = std::exp(after.model.log_scales[3 * i] - before.model.log_scales[3 * i]);
    EXPECT_NEAR(grown, stretches.back(), 1e-5);
  }
  return stretches;
}

TEST(SyntheticTest, DepthNoiseMovesGaussiansAlongTheirLineOfSight) {
  SyntheticOptions options = TinyOptions();
  const SyntheticScene before = Make(options);
  options.depth_noise = 0.01;
  const SyntheticScene after = Make(options);
  ExpectSamePhotosAndColors(before, after);
  const auto stretches = Stretches(before, after, size_t(options.floaters));
  double sum = 0, squares = 0;
  for (const double s : stretches) sum += s - 1, squares += (s - 1) * (s - 1);
  const double count = double(stretches.size());
  ASSERT_GT(count, 1000);
  // Of a thousand and more, the mean is good to 3 % of the deviation and the deviation to 2 %;
  // these are five times that.
  EXPECT_NEAR(sum / count, 0, 0.0015);
  EXPECT_NEAR(std::sqrt(squares / count), 0.01, 0.001);
}

TEST(SyntheticTest, DepthWaveMovesNeighborsAlike) {
  SyntheticOptions options = TinyOptions();
  const SyntheticScene before = Make(options);
  options.depth_wave = 0.02;
  const SyntheticScene after = Make(options);
  ExpectSamePhotosAndColors(before, after);
  const auto stretches = Stretches(before, after, size_t(options.floaters));
  const auto [least, most] = std::minmax_element(stretches.begin(), stretches.end());
  EXPECT_GE(*least, 0.98 - 1e-5);
  EXPECT_LE(*most, 1.02 + 1e-5);
  EXPECT_GT(*most - *least, 0.02);
}

TEST(SyntheticTest, FloatersAreAsOpaqueAsAskedFor) {
  SyntheticOptions options = TinyOptions();
  options.floaters = 400;
  options.floater_opacity = 0.5;
  const GaussianModel model = Make(options).model;
  double most = 0;
  for (size_t i = model.NumGaussians() - 400; i < model.NumGaussians(); ++i) {
    most = std::max(most, 1 / (1 + std::exp(-double(model.opacity_logits[i]))));
  }
  // The largest of 400 numbers that are spread evenly up to 0.5.
  EXPECT_GT(most, 0.47);
  EXPECT_LE(most, 0.5 + 1e-6);
}

TEST(SyntheticTest, TheCloudIsScaledAndShifted) {
  SyntheticOptions options = TinyOptions();
  const SyntheticScene before = Make(options);
  options.cloud_scale = 1.1;
  options.cloud_shift = 0.02;
  const SyntheticScene after = Make(options);
  ExpectSamePhotosAndColors(before, after);
  ExpectSameBytes(before.model.means, after.model.means);
  const Eigen::Vector3d eye = MiddleOfCameras(before);
  ASSERT_GT(before.reconstruction.points.size(), 10u);
  ASSERT_EQ(before.reconstruction.points.size(), after.reconstruction.points.size());
  for (const auto& [id, point] : before.reconstruction.points) {
    const SparsePoint& moved = after.reconstruction.points.at(id);
    const Eigen::Vector3d expected = eye + 1.1 * (point.xyz - eye) + Eigen::Vector3d(0.02, 0, 0.02);
    EXPECT_LT((moved.xyz - expected).norm(), 1e-12);
    EXPECT_EQ(moved.track.size(), point.track.size());
  }
}

TEST(SyntheticTest, BareWallsHaveNoTextureAndNoPoints) {
  SyntheticOptions options = SmallOptions();
  options.views = 3;
  const SyntheticScene papered = Make(options);
  options.bare_walls = true;
  const SyntheticScene bare = Make(options);
  const int wall = IdOf(bare, "wallpaper");
  // Mean difference between neighbors on the wall.
  const auto contrast = [&](const SyntheticScene& scene) {
    const SyntheticView& view = scene.views[1];
    double sum = 0;
    int64_t count = 0;
    for (int y = 0; y < view.photo.height; ++y) {
      for (int x = 0; x + 1 < view.photo.width; ++x) {
        if (view.object_ids(x, y) != wall || view.object_ids(x + 1, y) != wall) continue;
        sum += std::abs(view.photo(x, y, 1) - view.photo(x + 1, y, 1));
        ++count;
      }
    }
    EXPECT_GT(count, 100);
    return sum / double(count);
  };
  // The skirting board and shadows still change a little.
  EXPECT_LT(contrast(bare), 0.3 * contrast(papered));
  const auto on_wall = [&](const SyntheticScene& scene) {
    int64_t count = 0;
    for (const SyntheticView& view : scene.views) {
      for (const Observation& o : scene.reconstruction.FindView(view.name)->observations) {
        if (o.point_id == kInvalidPointId) continue;
        count += view.object_ids(int(o.xy.x()), int(o.xy.y())) == wall;
      }
    }
    return count;
  };
  EXPECT_LT(20 * on_wall(bare), on_wall(papered));
  for (size_t v = 0; v < bare.views.size(); ++v) {
    EXPECT_EQ(bare.views[v].object_ids.data, papered.views[v].object_ids.data);
  }
}

TEST(SyntheticTest, CamerasGoAllAroundTheTableInTheOpen) {
  SyntheticOptions options = TinyOptions();
  options.views = 6;
  options.around = true;
  const SyntheticScene scene = Make(options);
  Eigen::Vector3d before = Eigen::Vector3d::Zero();
  for (const auto& [id, view] : scene.reconstruction.views) {
    Eigen::Vector3d center = scene.reconstruction.Posed(view).Center();
    center.y() = 0;
    center.normalize();
    // A sixth of a turn from one to the next.
    if (!before.isZero()) {
      EXPECT_NEAR(before.dot(center), 0.5, 1e-9);
    }
    before = center;
  }
  const auto& names = scene.object_names;
  EXPECT_EQ(std::find(names.begin(), names.end(), "wallpaper"), names.end());
  const int table = IdOf(scene, "table");
  for (const SyntheticView& view : scene.views) {
    const auto& ids = view.object_ids.data;
    EXPECT_GT(std::count(ids.begin(), ids.end(), uint8_t(table)), int64_t(ids.size() / 20))
        << view.name;
  }
  options.bare_walls = true;
  EXPECT_THROW(options.Check(), OptionError);
}

}  // namespace
}  // namespace retint
