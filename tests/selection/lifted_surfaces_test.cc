// SPDX-License-Identifier: BSD-3-Clause
#include "selection/lifted_surfaces.h"

#include <gtest/gtest.h>

#include "base/error.h"
#include "selection/gaussian_graph.h"
#include "tests/selection/tiny_gaussians.h"

namespace retint {
namespace {

constexpr double kSunk = 0.3;  // of its radius

// The tiny world's ball, sunk into the wall so far that every view sees where the two meet.
TinyWorld TouchingWorld() {
  TinyWorld world = TinyWorld::Make(5, 0, 0, 3);
  // The wall's normal points to the cameras.
  const double height = world.wall_normal.dot(world.ball_center) - world.wall_offset;
  world.ball_center -= (height + kSunk * world.ball_radius) * world.wall_normal;
  return world;
}

TEST(LiftedSurfaces, HaveValleysWhereOneThingStandsOnAnother) {
  const TinyWorld world = TouchingWorld();
  const TinyGaussians gaussians(world);
  Renderer renderer(CreateBackend("cpu"), gaussians.model);
  std::vector<const View*> views;
  for (const auto& [id, view] : world.reconstruction.views) views.push_back(&view);
  Monitor monitor;
  const auto valleys =
      LiftSurfaces(renderer, gaussians.model, world.reconstruction, views, monitor).valleys;
  ASSERT_EQ(valleys.size(), gaussians.model.NumGaussians());
  // By the distance from the circle in which the ball meets the wall.
  const double ring = std::sqrt(1 - kSunk * kSunk) * world.ball_radius;
  double near = 0, nears = 0, far = 0, fars = 0;
  for (size_t g = 0; g < valleys.size(); ++g) {
    EXPECT_GE(valleys[g], 0);
    EXPECT_LE(valleys[g], 1);
    const Eigen::Vector3d at =
        Eigen::Map<const Eigen::Vector3f>(&gaussians.model.means[3 * g]).cast<double>();
    const Eigen::Vector3d from = at - world.ball_center;
    const double height = world.wall_normal.dot(at) - world.wall_offset;
    const double across = (from - from.dot(world.wall_normal) * world.wall_normal).norm();
    if (height < -0.01) continue;  // behind the wall
    const double away = std::hypot(height, across - ring);
    if (gaussians.on_ball[g] && height > 0.5) far += double(valleys[g]), ++fars;
    if (away < 0.1) near += double(valleys[g]), ++nears;
  }
  ASSERT_GT(nears, 20);
  ASSERT_GT(fars, 100);
  EXPECT_GT(near / nears, 0.1);
  EXPECT_LT(far / fars, 0.3 * near / nears);  // the top of the ball bends, but outward
}

// Two floaters with a third of the light; views see each before the ball or the wall. Everything
// else is a surface, and the ball's rim is one before the wall.
TEST(LiftedSurfaces, FloatWhereTheyHangBeforeSurfaces) {
  const TinyWorld world = TinyWorld::Make(5, 0, 0, 3);
  TinyGaussians gaussians(world);
  const size_t surfaces = gaussians.model.NumGaussians();
  gaussians.AddFloater({0.1, 0, 2.5}, 0.15);
  gaussians.AddFloater({-0.8, 0.3, 3}, 0.2);
  Renderer renderer(CreateBackend("cpu"), gaussians.model);
  Monitor monitor;
  const auto floating = LiftSurfaces(renderer, gaussians.model, world.reconstruction,
                                     world.reconstruction.ViewsByName(), monitor)
                            .floating;
  ASSERT_EQ(floating.size(), surfaces + 2);
  EXPECT_GT(floating[surfaces], 0.8f);
  EXPECT_GT(floating[surfaces + 1], 0.8f);
  size_t wrong = 0;
  for (size_t g = 0; g < surfaces; ++g) wrong += floating[g] > GaussianGraph::kFloating;
  EXPECT_LE(wrong, surfaces / 50);  // on the rim, or rarely visible
}

TEST(LiftedSurfaces, AreNoneOfWhatNoViewSees) {
  const TinyWorld world = TouchingWorld();
  TinyGaussians gaussians(world);
  gaussians.Add({0, 0, -50}, Eigen::Vector3d::UnitZ(), 0.1, false);  // behind every camera
  Renderer renderer(CreateBackend("cpu"), gaussians.model);
  const View& view = world.reconstruction.views.at(1);
  Monitor monitor;
  const LiftedSurfaces lifted =
      LiftSurfaces(renderer, gaussians.model, world.reconstruction, {&view}, monitor);
  EXPECT_EQ(lifted.valleys.back(), 0);
  EXPECT_EQ(lifted.floating.back(), 0);
  monitor.Cancel();
  EXPECT_THROW(LiftSurfaces(renderer, gaussians.model, world.reconstruction, {&view}, monitor),
               Cancelled);
}

}  // namespace
}  // namespace retint
