// SPDX-License-Identifier: BSD-3-Clause
// With few cameras, completion looks from more sides than they do.
#include <memory>
#include <numbers>
#include <numeric>

#include <gtest/gtest.h>

#include "editing/edit_session.h"
#include "scene/look_along.h"
#include "selection/lifted_surfaces.h"
#include "tests/editing/tiny_session.h"

namespace retint {
namespace {

// The tiny world's ball above a floor, with cameras all around it.
TinyWorld World(int cameras) {
  TinyWorld world;
  world.ball_center = {0, -0.1, 0};
  world.wall_normal = -Eigen::Vector3d::UnitY();
  world.wall_offset = -1;
  world.reconstruction.cameras[1] = Camera::Pinhole(1, 80, 60, 75, 75, 40, 30);
  for (int i = 0; i < cameras; ++i) {
    const double turn = 2 * std::numbers::pi * i / cameras;
    const Eigen::Vector3d eye(4 * std::cos(turn), -2, 4 * std::sin(turn));
    View view;
    view.id = ViewId(i + 1);
    view.name = "view" + std::to_string(i + 1) + ".png";
    view.camera_id = 1;
    view.cam_from_world = LookAlong(eye, world.ball_center - eye, -Eigen::Vector3d::UnitY());
    world.reconstruction.views[view.id] = view;
  }
  return world;
}

struct Found {
  // As a session finds them, and by its cameras alone.
  ProjectedMasks session, cameras;
  // Of all Gaussians, in pixels.
  static double Seen(const ProjectedMasks& masks) {
    return std::accumulate(masks.visible.begin(), masks.visible.end(), 0.0);
  }
};

Found Find(int num_cameras, const ProjectorOptions& options) {
  const TinyWorld world = World(num_cameras);
  const std::unique_ptr<EditSession> one = TinySession(world);
  EditSession& session = *one;
  Monitor monitor;
  SelectOptions select;
  select.depth_method = "gaussian";
  const std::vector<PaintedView> painted = {
      {world.view(0).name, world.Posed(0), world.BallMask(world.Posed(0))}};
  const SelectionCloud cloud = session.selection().Select(painted, select, monitor).cloud;
  Found found;
  found.session = session.selection().Project(cloud, painted, options, monitor);
  const GaussianGraph graph(
      session.scene().original(), monitor, std::nullopt,
      LiftSurfaces(session.scene().renderer(), session.scene().original(),
                   session.scene().reconstruction(), session.scene().views(), monitor));
  found.cameras =
      ProjectMasks(cloud, painted, session.scene().reconstruction(), session.scene().views(),
                   session.scene().renderer(), options, monitor, &graph);
  return found;
}

TEST(AddedViews, FillUpWhereCamerasAreFew) {
  const Found found = Find(4, {});
  EXPECT_EQ(found.session.masks.size(), 4u);  // they are given no masks
  // Four cameras and twenty views, which see about as much each.
  const double times = Found::Seen(found.session) / Found::Seen(found.cameras);
  EXPECT_GT(times, 4);
  EXPECT_LT(times, 8);
}

TEST(AddedViews, AreNoneWhereCamerasAreMany) {
  const Found found = Find(24, {});
  EXPECT_EQ(found.session.visible, found.cameras.visible);
  EXPECT_EQ(found.session.shares, found.cameras.shares);
}

TEST(AddedViews, AreNoneWithoutCompletion) {
  ProjectorOptions off;
  off.completion = Completion::kOff;
  const Found found = Find(4, off);
  EXPECT_TRUE(found.session.visible.empty());
  EXPECT_EQ(found.session.shares, found.cameras.shares);
}

}  // namespace
}  // namespace retint
