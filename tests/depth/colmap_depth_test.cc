// SPDX-License-Identifier: BSD-3-Clause
#include "depth/colmap_depth.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "base/files.h"
#include "colmap_io/depth_map_io.h"
#include "colmap_io/workspace.h"
#include "tests/depth/plane_scene.h"
#include "tests/support/data.h"

namespace retint {
namespace {

using ::testing::HasSubstr;

const Camera kCamera = Camera::Pinhole(1, 120, 90, 100, 104, 58, 46);

// The plane's depth as seen from elsewhere: along each ray, where it meets the plane.
double DepthFrom(const PlaneScene& plane, const PosedCamera& view, double x, double y) {
  const Eigen::Vector3d origin = view.Center();
  const Eigen::Vector3d ray = view.Unproject({x, y}, 1) - origin;
  const Eigen::Vector3d normal(plane.slope_x, plane.slope_y, -1);
  return -(plane.distance + normal.dot(origin)) / normal.dot(ray);
}

TEST(WarpDepth, MovesAPlaneExactly) {
  const PlaneScene plane{4, 0.3, -0.2};
  const PosedCamera source{kCamera, {}};
  PosedCamera target{Camera::Pinhole(2, 150, 110, 130, 130, 70, 60), {}};
  target.cam_from_world.rotation =
      Eigen::Quaterniond(Eigen::AngleAxisd(0.1, Eigen::Vector3d(0.2, 1, 0.1).normalized()));
  target.cam_from_world.translation = {0.2, -0.1, 0.3};
  const DepthMap warped = WarpDepth(plane.ExactDepth(kCamera), source, target, 0.05);
  int known = 0;
  for (int y = 0; y < warped.height; ++y) {
    for (int x = 0; x < warped.width; ++x) {
      if (!(warped(x, y) > 0)) continue;
      ++known;
      // Inverse depth is linear over a plane's image, so only float rounding is left.
      ASSERT_NEAR(warped(x, y) / DepthFrom(plane, target, x + 0.5, y + 0.5), 1, 1e-5);
    }
  }
  EXPECT_GT(known, 0.6 * 150 * 110);
  // Without holes: every pixel between two known ones of a row is known.
  for (int y = 20; y < 90; ++y) {
    int first = warped.width, last = -1, count = 0;
    for (int x = 0; x < warped.width; ++x) {
      if (!(warped(x, y) > 0)) continue;
      first = std::min(first, x);
      last = std::max(last, x);
      ++count;
    }
    EXPECT_EQ(count, last - first + 1) << "row " << y;
  }
}

TEST(WarpDepth, TheNearerHidesTheFartherAndEdgesAreNotBridged) {
  DepthMap map(120, 90, 6.0f);
  for (int y = 30; y < 60; ++y) {
    for (int x = 40; x < 80; ++x) map(x, y) = 3.0f;
  }
  PosedCamera target{kCamera, {}};
  target.cam_from_world.translation.x() = -0.6;  // the camera steps to the right
  const DepthMap warped = WarpDepth(map, {kCamera, {}}, target, 0.05);
  // Near content moves by 100 * 0.6 / 3 = 20 pixels, far by 10.
  EXPECT_NEAR(warped(40, 45), 3, 1e-4);
  EXPECT_NEAR(warped(22, 45), 3, 1e-4);
  EXPECT_NEAR(warped(90, 45), 6, 1e-4);
  EXPECT_EQ(warped(64, 45), 0) << "behind the box nothing is known";
  for (const float depth : warped.data) {
    EXPECT_TRUE(depth == 0 || std::abs(depth - 3) < 1e-3 || std::abs(depth - 6) < 1e-3) << depth;
  }
}

TEST(WarpDepth, IgnoresWhatLiesBehindTheTarget) {
  PosedCamera target{kCamera, {}};
  target.cam_from_world.translation.z() = -10;
  const DepthMap warped = WarpDepth(DepthMap(120, 90, 4.0f), {kCamera, {}}, target, 0.05);
  EXPECT_THAT(warped.data, ::testing::Each(0.0f));
}

TEST(ResampleDepth, TakesMapsOfAnotherResolution) {
  const PlaneScene plane{4, 0.3, -0.2};
  // A map of 60 x 45 covers the whole image of kCamera.
  const Camera half = Camera::Pinhole(1, 60, 45, 50, 52, 29, 23);
  const DepthMap depth = ResampleDepth(plane.ExactDepth(half), kCamera, kCamera, 0.05);
  for (int y = 1; y < 89; ++y) {
    for (int x = 1; x < 119; ++x) {
      ASSERT_NEAR(depth(x, y) / plane.Depth(kCamera, x + 0.5, y + 0.5), 1, 1e-5);
    }
  }
  const DepthMap same = plane.ExactDepth(kCamera);
  const DepthMap copy = ResampleDepth(same, kCamera, kCamera, 0.05);
  for (size_t i = 0; i < same.data.size(); ++i) ASSERT_NEAR(copy.data[i], same.data[i], 1e-5);
}

TEST(ResampleDepth, DoesNotMixAcrossEdgesOrHoles) {
  DepthMap map(60, 45, 6.0f);
  for (int y = 0; y < 45; ++y) {
    for (int x = 0; x < 30; ++x) map(x, y) = y < 20 ? 3.0f : 0.0f;
  }
  const DepthMap depth = ResampleDepth(map, kCamera, kCamera, 0.05);
  for (const float d : depth.data) {
    EXPECT_TRUE(d == 0 || std::abs(d - 3) < 1e-5 || std::abs(d - 6) < 1e-5) << d;
  }
  EXPECT_NEAR(depth(59, 10), 3, 1e-5);
  EXPECT_NEAR(depth(60, 10), 6, 1e-5);
  EXPECT_EQ(depth(59, 60), 0);
}

// A workspace in memory: three views side by side of one plane; maps where the test writes them.
class ColmapDepth : public ::testing::Test {
 protected:
  ColmapDepth() {
    workspace_.root = folder_.path();
    workspace_.depth_map_folder = folder_ / "stereo/depth_maps";
    auto& reconstruction = workspace_.reconstruction;
    reconstruction.cameras[1] = kCamera;
    for (ViewId id = 1; id <= 3; ++id) {
      View view;
      view.id = id;
      view.name = "view" + std::to_string(id) + ".jpg";
      view.camera_id = 1;
      view.cam_from_world.translation.x() = -0.3 * double(id);
      reconstruction.views[id] = view;
    }
    reconstruction.points[1].xyz = {0, 0, 4};
  }
  PosedCamera Camera(ViewId id) const {
    return workspace_.reconstruction.Posed(workspace_.reconstruction.views.at(id));
  }
  DepthMap Exact(ViewId id) const {
    DepthMap depth(kCamera.width, kCamera.height);
    for (int y = 0; y < depth.height; ++y) {
      for (int x = 0; x < depth.width; ++x) {
        depth(x, y) = float(DepthFrom(plane_, Camera(id), x + 0.5, y + 0.5));
      }
    }
    return depth;
  }
  void WriteMap(ViewId id, const DepthMap& depth, const std::string& kind = "geometric") {
    WriteDepthMap(
        workspace_.depth_map_folder / ("view" + std::to_string(id) + ".jpg." + kind + ".bin"),
        depth);
  }

  TempFolder folder_;
  PlaneScene plane_{4, 0.1, 0.2};
  Workspace workspace_;
  Monitor monitor_;
};

TEST_F(ColmapDepth, UsesTheViewsOwnMapGeometricFirst) {
  WriteMap(1, Exact(1));
  WriteMap(1, DepthMap(120, 90, 9.0f), "photometric");
  WriteMap(2, DepthMap(120, 90, 7.0f), "photometric");
  ColmapDepthEstimator estimator(workspace_);
  const auto own = estimator.Estimate(Camera(1), monitor_);
  EXPECT_EQ(own.method, "colmap");
  EXPECT_NEAR(own.depth(60, 45), Exact(1)(60, 45), 1e-5);
  EXPECT_EQ(own.valid_fraction, 1);
  EXPECT_THAT(own.reason, HasSubstr("100.0 % of the pixels from the view's own map"));
  EXPECT_NEAR(estimator.Estimate(Camera(2), monitor_).depth(60, 45), 7, 1e-4);
}

TEST_F(ColmapDepth, WarpsNeighboursWhereTheViewHasNone) {
  WriteMap(1, Exact(1));
  WriteMap(3, Exact(3));
  const auto estimate = ColmapDepthEstimator(workspace_).Estimate(Camera(2), monitor_);
  const DepthMap truth = Exact(2);
  EXPECT_GT(estimate.valid_fraction, 0.98);
  for (size_t i = 0; i < truth.data.size(); ++i) {
    if (!estimate.valid.data[i]) continue;
    ASSERT_NEAR(estimate.depth.data[i] / truth.data[i], 1, 1e-4);
  }
  EXPECT_THAT(estimate.reason, HasSubstr("2 warped maps"));
}

TEST_F(ColmapDepth, FillsHolesOfItsOwnMapFromNeighbours) {
  DepthMap holey = Exact(2);
  for (int y = 30; y < 60; ++y) {
    for (int x = 50; x < 80; ++x) holey(x, y) = 0;
  }
  WriteMap(2, holey);
  WriteMap(3, Exact(3));
  const auto estimate = ColmapDepthEstimator(workspace_).Estimate(Camera(2), monitor_);
  EXPECT_NEAR(estimate.depth(65, 45) / Exact(2)(65, 45), 1, 1e-4);
  EXPECT_EQ(estimate.valid(65, 45), 255);
}

TEST_F(ColmapDepth, LeavesUnknownOrFallsBackToTheGaussians) {
  DepthMap half = Exact(1);
  for (int y = 0; y < 90; ++y) {
    for (int x = 60; x < 120; ++x) half(x, y) = 0;
  }
  WriteMap(1, half);
  const auto alone = ColmapDepthEstimator(workspace_).Estimate(Camera(1), monitor_);
  EXPECT_EQ(alone.depth(100, 45), 0);
  EXPECT_EQ(alone.valid(100, 45), 0);
  EXPECT_NEAR(alone.valid_fraction, 0.5, 0.02);

  Renderer renderer(CreateBackend("cpu"), plane_.Model(4, 0.08, 1));
  const auto filled = ColmapDepthEstimator(workspace_, {}, &renderer).Estimate(Camera(1), monitor_);
  EXPECT_NEAR(filled.depth(100, 45) / Exact(1)(100, 45), 1, 0.02);
  EXPECT_EQ(filled.valid(100, 45), 0);
  EXPECT_THAT(filled.reason, HasSubstr("Gaussians"));
}

TEST_F(ColmapDepth, SaysWhenNoMapCanBeUsed) {
  try {
    ColmapDepthEstimator estimator(workspace_);
    FAIL() << "a workspace without maps was taken";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("depth_maps"));
    EXPECT_THAT(error.what(), HasSubstr("patch_match_stereo"));
  }
  WriteMap(1, Exact(1));
  PosedCamera away = Camera(1);
  away.cam_from_world.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(3, Eigen::Vector3d::UnitY()));
  EXPECT_THROW(ColmapDepthEstimator(workspace_).Estimate(away, monitor_), InputError);
  WriteFile(workspace_.depth_map_folder / "view1.jpg.geometric.bin", "120&90&1&short");
  EXPECT_THROW(ColmapDepthEstimator(workspace_).Estimate(Camera(1), monitor_), InputError);
  workspace_.reconstruction.cameras[1].model = CameraModelId::kOpenCV;
  workspace_.reconstruction.cameras[1].params.resize(8);
  EXPECT_THROW(ColmapDepthEstimator{workspace_}, InputError);
}

TEST_F(ColmapDepth, RefusesBadOptionsAndStopsWhenCancelled) {
  WriteMap(1, Exact(1));
  EXPECT_THROW(ColmapDepthEstimator(workspace_, {.max_sources = 0}), OptionError);
  EXPECT_THROW(ColmapDepthEstimator(workspace_, {.edge_tolerance = 0}), OptionError);
  EXPECT_THROW(ColmapDepthEstimator(workspace_, {.agree_tolerance = 1}), OptionError);
  monitor_.Cancel();
  EXPECT_THROW(ColmapDepthEstimator(workspace_).Estimate(Camera(1), monitor_), Cancelled);
}

TEST(ColmapDepthReal, OneViewsMapWarpsOntoTheOthers) {
  RETINT_REQUIRE_DATA("colmap/two_views_dense");
  Workspace workspace = Workspace::Open(DataPath("colmap/two_views_dense"));
  Monitor monitor;
  const PosedCamera view = workspace.reconstruction.Posed(workspace.RequireView("frame_0234.png"));
  const auto own = ColmapDepthEstimator(workspace).Estimate(view, monitor);
  EXPECT_EQ(own.depth.width, view.camera.width);
  EXPECT_THAT(own.reason, HasSubstr("own map"));

  // The same view, knowing only the other's map.
  TempFolder folder;
  std::filesystem::copy_file(
      DataPath("colmap/two_views_dense/stereo/depth_maps/frame_0213.png.geometric.bin"),
      folder / "frame_0213.png.geometric.bin");
  const DepthMap original =
      ReadDepthMap(*workspace.FindDepthMap(workspace.RequireView("frame_0234.png")));
  workspace.depth_map_folder = folder.path();
  const auto warped = ColmapDepthEstimator(workspace).Estimate(view, monitor);
  const DepthMap direct =
      ResampleDepth(original, view.camera, view.camera, ColmapDepthOptions{}.edge_tolerance);
  std::vector<double> errors;
  for (size_t i = 0; i < direct.data.size(); ++i) {
    if (direct.data[i] > 0 && warped.depth.data[i] > 0) {
      errors.push_back(std::abs(warped.depth.data[i] / direct.data[i] - 1));
    }
  }
  ASSERT_GT(errors.size(), 0.05 * double(direct.data.size()));
  std::nth_element(errors.begin(), errors.begin() + std::ptrdiff_t(errors.size() / 2),
                   errors.end());
  // COLMAP's geometric filter itself lets maps differ by about 1 %.
  EXPECT_LT(errors[errors.size() / 2], 0.01);
}

}  // namespace
}  // namespace retint
