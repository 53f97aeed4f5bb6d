// SPDX-License-Identifier: BSD-3-Clause
// Tile lists: no pixel with alpha >= 1/255 is lost and few tiles are listed in vain.
#include <cmath>
#include <set>

#include "kernels/common/blend.h"
#include "kernels/common/tiles.h"
#include "kernels/cpu/geometry.h"
#include "kernels/cpu/reached_tiles.h"
#include "tests/kernels/test_scene.h"

namespace retint {
namespace {

TEST(Projection, TileListsAreExact) {
  std::mt19937 rng = TestRng();
  const TestModel model = RandomModel(rng, 1500);
  const auto backend = MakeBackend("cpu");
  const auto uploaded = backend->blend().UploadModel(model.arrays());
  const auto geometry = backend->blend().PrepareView(*uploaded, TestCamera(333, 222));
  const auto& view = dynamic_cast<const CpuViewGeometry&>(*geometry);
  std::set<std::pair<int, int>> listed;  // (row, tile)
  for (size_t i = 0; i < view.tile_ids.size(); ++i) {
    for (int64_t e = view.tile_begin[i]; e < view.tile_begin[i + 1]; ++e) {
      listed.emplace(view.entries[size_t(e)], view.tile_ids[i]);
      if (e > view.tile_begin[i]) {
        EXPECT_LT(view.entries[size_t(e - 1)], view.entries[size_t(e)]);
      }
    }
  }
  EXPECT_EQ(listed.size(), view.entries.size());
  size_t needed = 0;
  for (int row = 0; row < view.num_rows(); ++row) {
    const Splat& splat = view.splats[size_t(row)];
    std::set<int> reached;
    for (int y = 0; y < 222; ++y) {
      for (int x = 0; x < 333; ++x) {
        const float dx = float(x) + 0.5f - splat.x, dy = float(y) + 0.5f - splat.y;
        if (SplatExponent(splat, dx, dy) < kLog2MinAlpha) continue;
        reached.insert(y / kTileSize * view.tiles_x() + x / kTileSize);
        ASSERT_LE(std::fabs(dy), splat.half_height) << "row range of splat " << row;
      }
    }
    for (const int tile : reached) ASSERT_TRUE(listed.count({row, tile})) << row << " " << tile;
    needed += reached.size();
  }
  EXPECT_GT(needed, 1000u);
  // Ellipses that slip between pixel centres, and the slack, cost a little.
  EXPECT_LE(double(listed.size()), 1.03 * double(needed));
}

TEST(Projection, RowsOfTilesTogetherReachTheColumnsOfEachAlone) {
  std::mt19937 rng = TestRng();
  const TestModel model = RandomModel(rng, 3000);
  const auto backend = MakeBackend("cpu");
  const auto uploaded = backend->blend().UploadModel(model.arrays());
  const CameraParams camera = TestCamera(333, 222);
  const auto geometry = backend->blend().PrepareView(*uploaded, camera);
  const TileGrid grid(camera);
  std::vector<int32_t> firsts(size_t(grid.tiles_y + kRowSlack)), lasts(firsts.size());
  int reached = 0, missed = 0;
  for (Splat splat : dynamic_cast<const CpuViewGeometry&>(*geometry).splats) {
    splat.x += Uniform(rng, -100, 100);  // some beyond the borders
    const Reach reach = ReachOf(splat);
    const TileRows rows = ReachedRows(grid, reach, splat.y);
    ReachedColumnsOfTarget()(grid, reach, splat.x, splat.y, rows, firsts.data(), lasts.data());
    for (int row = rows.first; row <= rows.last; ++row) {
      const auto i = size_t(row - rows.first);
      int first = 0, last = -1;
      if (!ReachedColumns(grid, reach, splat.x, splat.y, rows, row, &first, &last)) {
        EXPECT_GT(firsts[i], lasts[i]);
        ++missed;
        continue;
      }
      EXPECT_EQ(firsts[i], first);
      EXPECT_EQ(lasts[i], last);
      ++reached;
    }
  }
  EXPECT_GT(reached, 1000);
  EXPECT_GT(missed, 10);
}

TEST(Projection, SlotsGroupTheEntriesOfARow) {
  std::mt19937 rng = TestRng();
  const TestModel model = RandomModel(rng, 9000);  // more than one piece
  const auto backend = MakeBackend("cpu");
  const auto uploaded = backend->blend().UploadModel(model.arrays());
  const auto geometry = backend->blend().PrepareView(*uploaded, TestCamera(333, 222));
  const auto& view = dynamic_cast<const CpuViewGeometry&>(*geometry);
  std::vector<bool> taken(view.entries.size(), false);
  for (size_t e = 0; e < view.entries.size(); ++e) {
    const size_t row = size_t(view.entries[e]), slot = view.slots[e];
    ASSERT_GE(int64_t(slot), view.row_begin[row]);
    ASSERT_LT(int64_t(slot), view.row_begin[row + 1]);
    ASSERT_FALSE(taken[slot]);
    taken[slot] = true;
  }
  EXPECT_GT(geometry->bytes(), view.entries.size() * 8 + view.splats.size() * sizeof(Splat));
}

TEST(Projection, CullsWhatCannotBeSeen) {
  const CameraParams camera = TestCamera(64, 64);
  const glm::mat3 world_from_cam = glm::transpose(RotationOf(camera));
  const glm::vec3 t(camera.translation[0], camera.translation[1], camera.translation[2]);
  const auto visible = [&](const glm::vec3& in_cam, float opacity) {
    Splat splat;
    return ProjectGaussian(camera, world_from_cam * (in_cam - t), {1e-4f, 0, 0, 1e-4f, 0, 1e-4f},
                           opacity, /*compensate=*/false, &splat);
  };
  EXPECT_TRUE(visible({0, 0, 1}, 0.5f));
  EXPECT_TRUE(visible({0, 0, 0.21f}, 0.5f));
  EXPECT_FALSE(visible({0, 0, 0.19f}, 0.5f));
  EXPECT_FALSE(visible({0, 0, -1}, 0.5f));
  EXPECT_FALSE(visible({0, 0, 1}, 0.0039f));
  EXPECT_TRUE(visible({0, 0, 1}, 0.0040f));
  EXPECT_FALSE(visible({NAN, 0, 1}, 0.5f));
}

// A round Gaussian of deviation s pixels: S = s^2 I, so the factor is s^2 / (s^2 + 0.3).
TEST(Projection, AnAntialiasedGaussianKeepsItsLight) {
  CameraParams camera = TestCamera(64, 64);
  camera.fy = camera.fx;
  const glm::mat3 world_from_cam = glm::transpose(RotationOf(camera));
  const glm::vec3 t(camera.translation[0], camera.translation[1], camera.translation[2]);
  const glm::vec3 middle = world_from_cam * (glm::vec3(0, 0, 2) - t);
  const auto splat_of = [&](double deviation, float opacity, bool compensate, Splat* splat) {
    const auto variance = float(std::pow(deviation * 2 / double(camera.fx), 2));
    return ProjectGaussian(camera, middle, {variance, 0, 0, variance, 0, variance}, opacity,
                           compensate, splat);
  };
  for (const double s : {0.1, 0.5, 1.0, 10.0}) {
    Splat plain, mip;
    ASSERT_TRUE(splat_of(s, 0.9f, false, &plain));
    ASSERT_TRUE(splat_of(s, 0.9f, true, &mip));
    const double factor = s * s / (s * s + 0.3);
    EXPECT_NEAR(std::exp2(double(mip.log2_opacity)), 0.9 * factor, 1e-5) << s;  // floats
    EXPECT_NEAR(std::exp2(double(plain.log2_opacity)), 0.9, 1e-6) << s;
    EXPECT_EQ(mip.a, plain.a);
    EXPECT_EQ(mip.b, plain.b);
    EXPECT_EQ(mip.c, plain.c);
  }
  // The factor ends at 0.005, with which an opaque Gaussian is visible, and one of half is not.
  Splat least;
  ASSERT_TRUE(splat_of(1e-4, 1, true, &least));
  EXPECT_NEAR(std::exp2(double(least.log2_opacity)), 0.005, 1e-6);
  EXPECT_FALSE(splat_of(1e-4, 0.5f, true, &least));
}

TEST(Projection, PixelCentresAreColmaps) {
  CameraParams camera = TestCamera(64, 48);
  const glm::vec2 pixel = ImgFromCam(camera, {0, 0, 2});
  EXPECT_FLOAT_EQ(pixel.x, camera.cx);
  EXPECT_FLOAT_EQ(pixel.y, camera.cy);
}

// A needle seen end on and along: its conic stays an ellipse, its lists stay finite.
TEST(Projection, SurvivesNeedlesAndGiants) {
  std::mt19937 rng = TestRng();
  TestModel model = RandomModel(rng, 200);
  for (size_t i = 0; i < model.log_scales.size(); ++i) {
    model.log_scales[i] = i % 3 == 0 ? 4.0f : -12.0f;
  }
  const auto uploaded_model = [&](Backend& b) { return b.blend().UploadModel(model.arrays()); };
  for (const std::string& name : TestedBackends()) {
    const auto backend = MakeBackend(name);
    const auto uploaded = uploaded_model(*backend);
    const auto view = backend->blend().PrepareView(*uploaded, TestCamera(128, 128));
    const std::vector<float> ones(size_t(view->num_rows()), 1.0f);
    const Blended blended = RunBlend(*backend, *view, ones, 1);
    for (size_t p = 0; p < blended.alpha.size(); ++p) {
      ASSERT_GE(blended.alpha[p], 0);
      ASSERT_LE(blended.alpha[p], 1);
      ASSERT_NEAR(blended.image[p], blended.alpha[p], 1e-5);  // W 1 = 1 - T
    }
  }
}

}  // namespace
}  // namespace retint
