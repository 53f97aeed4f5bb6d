// SPDX-License-Identifier: BSD-3-Clause
// Masks whose views are shared among ranks: on the CPU the same bits as those of one.
#include <vector>

#include <gtest/gtest.h>

#include "selection/mask_projector.h"
#include "selection/views_between.h"
#include "tests/selection/tiny_gaussians.h"
#include "tests/support/thread_ranks.h"

namespace retint {
namespace {

struct ProjectCase {
  const char* name;
  ProjectorKind kind;
  Completion completion;
};

class ProjectRanks : public testing::TestWithParam<ProjectCase> {};

TEST_P(ProjectRanks, MakeTheSameMasks) {
  const TinyWorld world = TinyWorld::Make(5, 2000, 0, 3);
  const TinyGaussians gaussians{world};
  const auto backend = CreateBackend("cpu");
  const PosedCamera posed = world.Posed(2);
  const Mask paint = world.BallMask(posed);
  CloudOptions all;  // the outlier filter would take the rim's points, which lie apart
  all.outlier_neighbors = 0;
  const SelectionCloud cloud =
      MakeCloud(posed, world.view(2).name, paint, world.Depth(posed), {}, {}, all);
  Monitor graph_monitor;
  const GaussianGraph graph(gaussians.model, graph_monitor);
  // Between the cameras, which stand on an arc of half a radian.
  const auto added =
      ViewsBetween({world.Posed(0), world.Posed(4)}, world.ball_center, posed.camera, 2);
  ASSERT_FALSE(added.empty());
  const auto project = [&] {
    Monitor monitor;
    Renderer renderer(backend, gaussians.model);
    ProjectorOptions options;
    options.kind = GetParam().kind;
    options.completion = GetParam().completion;
    return ProjectMasks(cloud, {{world.view(2).name, posed, paint}}, world.reconstruction,
                        world.reconstruction.ViewsByName(), renderer, options, monitor, &graph, {},
                        added);
  };
  const ProjectedMasks alone = project();
  ASSERT_EQ(alone.masks.size(), 5u);
  for (const int count : {2, 3}) {
    SCOPED_TRACE(count);
    for (const ProjectedMasks& one : MakeOnRanks<ProjectedMasks>(count, project)) {
      EXPECT_EQ(one.shares, alone.shares);
      EXPECT_EQ(one.confidence, alone.confidence);
      EXPECT_EQ(one.visible, alone.visible);
      EXPECT_EQ(one.mean_coverage, alone.mean_coverage);
      ASSERT_EQ(one.masks.size(), alone.masks.size());
      for (const auto& [name, mask] : alone.masks) EXPECT_EQ(one.masks.at(name).data, mask.data);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    Kinds, ProjectRanks,
    testing::Values(ProjectCase{"Completed", ProjectorKind::kGaussians, Completion::kNear},
                    ProjectCase{"Gaussians", ProjectorKind::kGaussians, Completion::kOff},
                    ProjectCase{"Surfels", ProjectorKind::kSurfels, Completion::kOff}),
    [](const auto& one) { return one.param.name; });

}  // namespace
}  // namespace retint
