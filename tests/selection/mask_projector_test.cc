// SPDX-License-Identifier: BSD-3-Clause
#include "selection/mask_projector.h"

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "scene/mask_pixels.h"
#include "selection/evidence.h"
#include "selection/mask_score.h"
#include "selection/view_depth.h"
#include "tests/selection/tiny_gaussians.h"

namespace retint {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

// Coverage of a view by squares of `square` pixels or, where that is 0, discs of `scale`
// footprints.
ScalarImage Draw(const SelectionCloud& cloud, const PosedCamera& view, const DepthMap& depth,
                 float square, float scale) {
  const auto backend = CreateBackend("cpu");
  std::vector<CloudPoint> points;
  for (const auto& point : cloud.points) {
    const auto &at = point.position, &normal = point.normal;
    points.push_back({{at.x(), at.y(), at.z()},
                      {normal.x(), normal.y(), normal.z()},
                      point.footprint,
                      point.coverage});
  }
  ScalarImage drawn(depth.width, depth.height);
  DrawCloudParams draw{ToCameraParams(view), points.data(), int64_t(points.size()), square, scale,
                       depth.data.data(),    0.02f,         drawn.data.data()};
  backend->mask().DrawCloud(draw);
  return drawn;
}

class MaskProjectorTest : public ::testing::Test {
 protected:
  TinyWorld world = TinyWorld::Make(5, 2000, 0, 3);
  TinyGaussians gaussians{world};
  Renderer renderer{CreateBackend("cpu"), gaussians.model};
  Monitor monitor;
  ProjectorOptions options;
  std::vector<const View*> views = world.reconstruction.ViewsByName();

  PaintedView Paint(int view_idx) const {
    return {world.view(view_idx).name, world.Posed(view_idx),
            world.BallMask(world.Posed(view_idx))};
  }
  // All points: the outlier filter would take the rim's, which lie apart.
  SelectionCloud Cloud(int view_idx) const {
    CloudOptions all;
    all.outlier_neighbors = 0;
    const PosedCamera posed = world.Posed(view_idx);
    return MakeCloud(posed, world.view(view_idx).name, world.BallMask(posed), world.Depth(posed),
                     {}, {}, all);
  }
  ProjectedMasks Project(ProjectorKind kind, const SelectionCloud& cloud,
                         const std::vector<PaintedView>& painted) {
    options.kind = kind;
    return ProjectMasks(cloud, painted, world.reconstruction, views, renderer, options, monitor);
  }
  MaskScore Worst(const ProjectedMasks& projected) const {
    MaskScore worst = {1, 1, 1, 1};
    for (int i = 0; i < 5; ++i) {
      const MaskScore overlap =
          ScoreMask(projected.masks.at(world.view(i).name), world.BallMask(world.Posed(i)));
      worst.iou = std::min(worst.iou, overlap.iou);
      worst.precision = std::min(worst.precision, overlap.precision);
      worst.recall = std::min(worst.recall, overlap.recall);
    }
    return worst;
  }
};

TEST_F(MaskProjectorTest, SurfelsCoverWhatOneViewSees) {
  const auto projected = Project(ProjectorKind::kSurfels, Cloud(2), {});
  ASSERT_EQ(projected.masks.size(), 5u);
  EXPECT_TRUE(projected.shares.empty());
  const MaskScore worst = Worst(projected);
  // The ends of the arc see 14 degrees past the painted view's rim, some 6 % of the disc; the
  // surfels' discs reach half a pixel outside, 60 pixels wide: 4 %.
  EXPECT_GT(worst.recall, 0.85);
  EXPECT_GT(worst.precision, 0.9);
}

TEST_F(MaskProjectorTest, QuadsLeaveMoreHolesThanSurfels) {
  // Seen at twice the size, points of one pixel stand apart.
  PosedCamera near = world.Posed(2);
  near.cam_from_world.translation.z() -= 2.5;
  const DepthMap depth = world.Depth(near);
  const Mask truth = world.BallMask(near);
  const auto recall = [&](const ScalarImage& drawn) {
    Mask mask(drawn.width, drawn.height);
    for (size_t i = 0; i < mask.data.size(); ++i) mask.data[i] = drawn.data[i] > 0.5f ? 255 : 0;
    return ScoreMask(mask, truth).recall.value();
  };
  const SelectionCloud cloud = Cloud(2);
  const double quads = recall(Draw(cloud, near, depth, 1, 0));
  const double surfels = recall(Draw(cloud, near, depth, 0, 1.5));
  EXPECT_LT(quads, 0.5);
  EXPECT_GT(surfels, 0.85);
}

TEST_F(MaskProjectorTest, QuadsAndSurfelsStayBehindWhatHidesThem) {
  const SelectionCloud cloud = Cloud(2);
  const PosedCamera posed = world.Posed(2);
  // A sheet at half the distance over the left half of the image.
  DepthMap depth = world.Depth(posed);
  for (int y = 0; y < depth.height; ++y) {
    for (int x = 0; x < 80; ++x) depth(x, y) = 2;
  }
  for (const auto& drawn : {Draw(cloud, posed, depth, 3, 0), Draw(cloud, posed, depth, 0, 1.5)}) {
    double left = 0, right = 0;
    for (int y = 0; y < depth.height; ++y) {
      for (int x = 0; x < 160; ++x) (x < 80 ? left : right) += drawn(x, y);
    }
    EXPECT_EQ(left, 0);
    EXPECT_GT(right, 500);
  }
}

TEST_F(MaskProjectorTest, ASurfelIsADiscOfItsFootprint) {
  // One point straight ahead at z = 5, facing the camera and then turned by 60 degrees.
  PosedCamera view = world.Posed(2);
  view.cam_from_world = {};
  view.camera = Camera::Pinhole(1, 200, 200, 500, 500, 100.5, 100.5);
  SelectionCloud cloud;
  cloud.points.resize(1);
  cloud.points[0].position = {0, 0, 5};
  cloud.points[0].footprint = 0.1f;  // ten pixels here
  const auto extent = [&](const Eigen::Vector3f& normal) {
    cloud.points[0].normal = normal;
    const ScalarImage drawn = Draw(cloud, view, DepthMap(200, 200), 0, 2);
    int columns = 0, rows = 0;
    for (int i = 0; i < 200; ++i) {
      columns += drawn(i, 100) >= 0.5f;
      rows += drawn(100, i) >= 0.5f;
    }
    return std::pair(columns, rows);
  };
  const auto [width, height] = extent({0, 0, -1});
  EXPECT_NEAR(width, 2 * 20, 1.01);  // the diameter, 2 footprints of radius
  EXPECT_NEAR(height, 2 * 20, 1.01);
  const auto [slim, tall] = extent({std::sin(float(M_PI / 3)), 0, -0.5f});
  EXPECT_NEAR(slim, 20, 1.5);  // cos 60
  EXPECT_NEAR(tall, 40, 1.01);
  EXPECT_EQ(extent(Eigen::Vector3f::Zero()), std::pair(width, height));  // faces the viewer
}

TEST_F(MaskProjectorTest, GaussiansSelectTheBallInEveryView) {
  const auto projected = Project(ProjectorKind::kGaussians, Cloud(2), {Paint(2)});
  const MaskScore worst = Worst(projected);
  // Gaussians on the rim reach a pixel or two over it: 2 of 30 pixels of radius are 13 % of area.
  EXPECT_GT(worst.iou, 0.87);
  EXPECT_GT(worst.precision, 0.88);
  ASSERT_EQ(projected.shares.size(), gaussians.on_ball.size());
  int wall_selected = 0, front = 0, front_selected = 0;
  for (size_t g = 0; g < gaussians.on_ball.size(); ++g) {
    const float share = projected.shares[g];
    EXPECT_TRUE(share >= 0 && share <= 1);
    if (!gaussians.on_ball[g]) {
      wall_selected += share > 0.5f;
    } else if (gaussians.model.means[3 * g + 2] < 4.6f) {
      ++front;
      front_selected += share > 0.5f;
    }
  }
  EXPECT_GT(front_selected, front * 95 / 100);
  // Only parts that no view sees well, behind the ball, may be wrong.
  EXPECT_LT(wall_selected, 20);
  EXPECT_NEAR(projected.mean_coverage, 0.15, 0.05);  // the ball covers 2,800 of 19,200 pixels
}

// Fog of floaters before the ball, so dense that the ball is less than half of its pixels. Masks
// are the same as without it.
TEST_F(MaskProjectorTest, WhatFloatsBeforeTheBallHasNoSay) {
  TinyGaussians foggy(world);
  for (int i = 0; i < 98; ++i) {  // two layers
    foggy.AddFloater({0.35 * (i % 7 - 3), 0.35 * (i / 7 % 7 - 3), i < 49 ? 2.4 : 2.8}, 0.15);
  }
  const auto project = [&](const GaussianModel& model, bool knows) {
    Renderer other(CreateBackend("cpu"), model);
    LiftedSurfaces lifted;
    if (knows) lifted = LiftSurfaces(other, model, world.reconstruction, views, monitor);
    const GaussianGraph graph(model, monitor, std::nullopt, std::move(lifted));
    return ProjectMasks(Cloud(2), {Paint(2)}, world.reconstruction, views, other, options, monitor,
                        &graph);
  };
  const double clear = Worst(project(gaussians.model, true)).iou.value();
  EXPECT_LT(Worst(project(foggy.model, false)).iou, 0.7);
  EXPECT_GT(Worst(project(foggy.model, true)).iou, clear - 0.02);
}

// Shares of 0.4 are a mask of 0.3 and shares of 0.6 one of 0.7; faint alone is nothing.
TEST_F(MaskProjectorTest, WhatIsFaintFarFromTheMaskIsDropped) {
  const PosedCamera view = world.Posed(0);
  const auto of_share = [&](float share) {
    const std::vector<float> shares(size_t(renderer.model().count()), share);
    const Mask mask = RenderShares(renderer, view, shares, options);
    return *std::max_element(mask.data.begin(), mask.data.end());
  };
  EXPECT_EQ(of_share(0.4f), 0);
  EXPECT_NEAR(of_share(0.6f), 0.7 * 255, 8);
}

// One percent of the shorter side is 4.8 pixels. Beyond, shares of 0.4 are dropped.
TEST_F(MaskProjectorTest, BordersAreSoftForOnePercent) {
  PosedCamera view = world.Posed(2);
  view.camera = Camera::Pinhole(1, 640, 480, 600, 592, 324, 236);
  std::vector<float> shares;
  for (size_t g = 0; g < gaussians.on_ball.size(); ++g) {
    shares.push_back(gaussians.model.means[3 * g] < 0 ? 0.6f : 0.4f);
  }
  const Mask mask = RenderShares(renderer, view, shares, options);
  const auto is_firm_within = [&](int x, int y, int reach) {
    for (int v = y - reach; v <= y + reach; ++v) {
      for (int u = x - reach; u <= x + reach; ++u) {
        if (mask.Contains(u, v) && mask(u, v) >= 128) return true;
      }
    }
    return false;
  };
  int farthest = 0;
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      if (mask(x, y) == 0 || mask(x, y) >= 128) continue;
      int reach = 1;
      while (reach < 20 && !is_firm_within(x, y, reach)) ++reach;
      farthest = std::max(farthest, reach);
    }
  }
  EXPECT_EQ(farthest, 5);
}

// Dark walls that were trained on black. Pixels with less than half of the light are selected if
// all visible Gaussians are, except almost empty ones.
TEST_F(MaskProjectorTest, HalfTransparentSurfacesAreSelectedByWhatTheyShow) {
  for (float& logit : gaussians.model.opacity_logits) logit = -1.1f;
  Renderer pale(CreateBackend("cpu"), gaussians.model);
  const PosedCamera view = world.Posed(0);
  RenderRequest request;
  request.rgb = false;
  request.alpha = true;
  const ScalarImage alpha = pale.Render(view, request).alpha;
  const std::vector<float> shares(size_t(pale.model().count()), 1.0f);
  const Mask mask = RenderShares(pale, view, shares, options);
  int half_transparent = 0;
  for (size_t p = 0; p < mask.data.size(); ++p) {
    if (std::abs(alpha.data[p] - 1.0f / 3) < 0.01f) continue;
    EXPECT_EQ(mask.data[p] >= 128, alpha.data[p] > 1.0f / 3) << p;
    half_transparent += alpha.data[p] > 0.36f && alpha.data[p] < 0.49f;
  }
  EXPECT_GT(half_transparent, 100);
}

// Fog that lets nearly nothing through is no selection, whatever its shares.
TEST_F(MaskProjectorTest, FloatersAloneAreNotSelected) {
  TinyGaussians fog(world);
  fog.model = {};
  fog.on_ball.clear();
  for (int i = 0; i < 49 * 8; ++i) {
    fog.AddFloater({0.35 * (i % 7 - 3), 0.35 * (i / 7 % 7 - 3), 2.4 + 0.1 * (i / 49)}, 0.25);
  }
  Renderer foggy(CreateBackend("cpu"), fog.model);
  LiftedSurfaces lifted;
  lifted.valleys.assign(fog.on_ball.size(), 0);
  lifted.floating.assign(fog.on_ball.size(), 1);
  const GaussianGraph graph(fog.model, monitor, std::nullopt, std::move(lifted));
  const std::vector<float> shares(fog.on_ball.size(), 1.0f);
  RenderRequest request;
  request.alpha = true;
  const ScalarImage alpha = foggy.Render(world.Posed(2), request).alpha;
  EXPECT_GT(*std::max_element(alpha.data.begin(), alpha.data.end()), 0.9f);
  EXPECT_FALSE(AnyInside(RenderShares(foggy, world.Posed(2), shares, options, &graph)));
}

TEST_F(MaskProjectorTest, GaussiansWorkFromACloudAlone) {
  const MaskScore worst = Worst(Project(ProjectorKind::kGaussians, Cloud(2), {}));
  EXPECT_GT(worst.iou, 0.8);
}

TEST_F(MaskProjectorTest, PaintOfASecondViewCounts) {
  // The first view paints only the ball's left half; the last view the whole ball.
  PaintedView half = Paint(0), whole = Paint(4);
  for (int y = 0; y < 120; ++y) {
    for (int x = 80; x < 160; ++x) half.mask(x, y) = 0;
  }
  const PosedCamera posed = world.Posed(0);
  const auto cloud = MakeCloud(posed, half.name, half.mask, world.Depth(posed), {}, {}, {});
  const Mask truth = world.BallMask(world.Posed(2));
  const auto one = Project(ProjectorKind::kGaussians, cloud, {half});
  SelectionCloud both = cloud;
  Append(both, Cloud(4));
  const auto two = Project(ProjectorKind::kGaussians, both, {half, whole});
  const double before = ScoreMask(one.masks.at(views[2]->name), truth).recall.value();
  const double after = ScoreMask(two.masks.at(views[2]->name), truth).recall.value();
  EXPECT_LT(before, 0.65);
  EXPECT_GT(after, before + 0.1);
}

// m = (w A + B) / (w C + D) of each Gaussian, with A and C of the painted view, B and D of the
// others. The cross-ratio of four m equals that of their weights.
TEST_F(MaskProjectorTest, PaintCountsByItsWeight) {
  const SelectionCloud cloud = Cloud(2);
  PaintedView half = Paint(2);       // which the cloud contradicts
  options.visible_tolerance = 1e-6;  // so that other views believe the cloud
  for (int y = 0; y < 120; ++y) std::fill_n(&half.mask(0, y), 80, uint8_t{0});
  std::vector<std::vector<float>> shares;
  for (const double weight : {1, 2, 4, 8}) {
    options.painted_weight = weight;
    shares.push_back(Project(ProjectorKind::kGaussians, cloud, {half}).shares);
  }
  int told = 0;
  for (size_t g = 0; g < shares[0].size(); ++g) {
    const double m[] = {shares[0][g], shares[1][g], shares[2][g], shares[3][g]};
    if (std::abs(m[0] - m[3]) < 0.05) continue;
    // Single precision of the shares against differences of a hundredth.
    EXPECT_NEAR((m[0] - m[2]) * (m[1] - m[3]) / ((m[1] - m[2]) * (m[0] - m[3])), 9.0 / 7, 0.01);
    ++told;
  }
  EXPECT_GT(told, 20);
}

// The more, the smaller are shares of Gaussians of which the painted view sees a part.
TEST_F(MaskProjectorTest, WhatNobodyKnowsCountsByItsWeight) {
  const SelectionCloud cloud = Cloud(2);
  std::vector<std::vector<float>> shares;
  for (const double weight : {0.0, 0.1, 0.2}) {
    options.unknown_weight = weight;
    shares.push_back(Project(ProjectorKind::kGaussians, cloud, {Paint(2)}).shares);
  }
  int told = 0;
  for (size_t g = 0; g < shares[0].size(); ++g) {
    const double none = shares[0][g], once = shares[1][g], twice = shares[2][g];
    if (twice < 0.05 || none - twice < 0.05) continue;
    EXPECT_GT(none, once);
    EXPECT_GT(once, twice);
    ++told;
  }
  EXPECT_GT(told, 20);
}

// Rows of pixels that are left out, of many views most, are made up for.
TEST_F(MaskProjectorTest, VisibilityIsThatOfAllRows) {
  for (const int count : {5, 40}) {
    const TinyWorld around = TinyWorld::Make(count, 2000, 0, 3);
    const auto all = around.reconstruction.ViewsByName();
    const GaussianGraph graph(gaussians.model, monitor);
    const PosedCamera posed = around.Posed(2);
    const PaintedView painted = {around.view(2).name, posed, around.BallMask(posed)};
    const auto cloud =
        MakeCloud(posed, painted.name, painted.mask, around.Depth(posed), {}, {}, CloudOptions{});
    const ProjectedMasks projected = ProjectMasks(cloud, {painted}, around.reconstruction, all,
                                                  renderer, options, monitor, &graph, {all[2]});
    double visible = 0, shown = 0;
    for (const float pixels : projected.visible) visible += double(pixels);
    RenderRequest request;
    request.rgb = false;
    request.alpha = true;
    for (const View* view : all) {
      const auto alpha = renderer.Render(around.reconstruction.Posed(*view), request).alpha;
      for (const float value : alpha.data) shown += double(value);
    }
    EXPECT_NEAR(visible / shown, 1, 0.01) << count;
  }
}

TEST_F(MaskProjectorTest, WhatWasSeenOutsideThePaintIsNotSelected) {
  // A cloud with the painted pixels on the wall by mistake, as after a bad depth. Its evidence
  // yields to the paint, and views saw the wall outside the paint.
  const PosedCamera posed = world.Posed(2);
  DepthMap wall(160, 120);
  for (int y = 0; y < 120; ++y) {
    for (int x = 0; x < 160; ++x) {
      const Eigen::Vector3d step = posed.Unproject({x + 0.5, y + 0.5}, 1) - posed.Center();
      wall(x, y) = float((world.wall_offset - world.wall_normal.dot(posed.Center())) /
                         world.wall_normal.dot(step));
    }
  }
  const auto cloud =
      MakeCloud(posed, world.view(2).name, world.BallMask(posed), wall, {}, {}, CloudOptions{});
  const auto projected = Project(ProjectorKind::kGaussians, cloud, {Paint(2)});
  for (size_t g = 0; g < gaussians.on_ball.size(); ++g) {
    const Eigen::Vector3d mean(gaussians.model.means[3 * g], gaussians.model.means[3 * g + 1],
                               gaussians.model.means[3 * g + 2]);
    const auto at = posed.Project(mean);
    if (gaussians.on_ball[g] || !at || at->x() < 0 || at->y() < 0 || at->x() >= 160 ||
        at->y() >= 120) {
      continue;
    }
    const auto hit = world.Cast(posed, at->head<2>());
    // Wall Gaussians well beside the ball as the painted view sees it (their discs are 3 pixels).
    const Eigen::Vector3d ball = *posed.Project(world.ball_center);
    if (hit->on_ball || (at->head<2>() - ball.head<2>()).norm() < 40) continue;
    EXPECT_LT(projected.shares[g], 0.1f);
  }
}

TEST_F(MaskProjectorTest, IsDeterministicAndReportsProgress) {
  double last = 0;
  int steps = 0;
  Monitor counting([&](const Progress& progress) {
    EXPECT_EQ(progress.stage, "projection");
    EXPECT_GE(progress.fraction, last);
    last = progress.fraction;
    ++steps;
  });
  const SelectionCloud cloud = Cloud(2);
  const auto first = Project(ProjectorKind::kGaussians, cloud, {Paint(2)});
  const auto second =
      ProjectMasks(cloud, {Paint(2)}, world.reconstruction, views, renderer, options, counting);
  EXPECT_GE(steps, 10);
  EXPECT_EQ(first.shares, second.shares);
  for (const auto& [name, mask] : first.masks) EXPECT_EQ(mask.data, second.masks.at(name).data);
}

TEST_F(MaskProjectorTest, GivesOnlyTheMasksThatAreWanted) {
  const SelectionCloud cloud = Cloud(2);
  for (const auto kind :
       {ProjectorKind::kQuads, ProjectorKind::kSurfels, ProjectorKind::kGaussians}) {
    const auto all = Project(kind, cloud, {Paint(2)});
    const std::vector<const View*> wanted = {views[2], views[4]};
    const auto some = ProjectMasks(cloud, {Paint(2)}, world.reconstruction, views, renderer,
                                   options, monitor, nullptr, wanted);
    ASSERT_EQ(some.masks.size(), wanted.size());
    for (const View* view : wanted) {
      EXPECT_EQ(some.masks.at(view->name).data, all.masks.at(view->name).data);
    }
    EXPECT_EQ(some.shares, all.shares);
  }
}

TEST_F(MaskProjectorTest, CancelsBetweenViews) {
  int steps = 0;
  Monitor* self = nullptr;
  Monitor cancelling([&](const Progress&) {
    if (++steps == 3) self->Cancel();
  });
  self = &cancelling;
  EXPECT_THROW(
      ProjectMasks(Cloud(2), {}, world.reconstruction, views, renderer, options, cancelling),
      Cancelled);
  EXPECT_EQ(steps, 3);
}

TEST_F(MaskProjectorTest, AnswersBadInput) {
  const auto run = [&](const SelectionCloud& cloud, const std::vector<PaintedView>& painted) {
    return [&, cloud, painted] {
      ProjectMasks(cloud, painted, world.reconstruction, views, renderer, options, monitor);
    };
  };
  EXPECT_THAT(run({}, {Paint(2)}), ThrowsMessage<InputError>(HasSubstr("cloud has no points")));
  PaintedView small = Paint(2);
  small.mask = Mask(4, 4, 255);
  EXPECT_THAT(run(Cloud(2), {small}),
              ThrowsMessage<InputError>(HasSubstr("the mask of view view2.png is 4x4")));
  // A selection that no view sees: behind every camera.
  SelectionCloud lost = Cloud(2);
  for (auto& point : lost.points) point.position.z() -= 100;
  for (const auto kind :
       {ProjectorKind::kQuads, ProjectorKind::kSurfels, ProjectorKind::kGaussians}) {
    options.kind = kind;
    EXPECT_THAT(run(lost, {}), ThrowsMessage<InputError>(HasSubstr("reaches no view")));
  }
  // A selection of another object than the painted one.
  options.kind = ProjectorKind::kQuads;
  PaintedView corner = Paint(2);
  std::fill(corner.mask.data.begin(), corner.mask.data.end(), 0);
  corner.mask(0, 0) = 255;
  EXPECT_THAT(run(Cloud(2), {corner}),
              ThrowsMessage<InputError>(HasSubstr("nothing of what was painted")));
  views.clear();
  EXPECT_THROW(run(Cloud(2), {})(), InputError);
  options.share_threshold = 1;
  EXPECT_THROW(run(Cloud(2), {})(), OptionError);
}

TEST_F(MaskProjectorTest, PaintIsLookedUpOnlyOnSurfacesThatItSees) {
  const PosedCamera from = world.Posed(0), to = world.Posed(4);
  const Mask mask = world.BallMask(to);
  const std::vector<PaintedSurface> painted = {{"p", to, &mask, world.Depth(to)}};
  const DepthMap depth = world.Depth(from);
  const Evidence evidence = LookUpPaint(renderer.backend(), from, depth, painted, 0.03, 0.2);
  int seen = 0, wrong = 0, unseen = 0, blind = 0;
  for (int y = 0; y < 120; ++y) {
    for (int x = 0; x < 160; ++x) {
      const auto hit = world.Cast(from, {x + 0.5, y + 0.5});
      const auto at = to.Project(hit->position);
      const bool inside_image = at->x() >= 0 && at->y() >= 0 && at->x() < 160 && at->y() < 120;
      const bool visible =
          inside_image && std::abs(world.Cast(to, at->head<2>())->z - at->z()) < 0.3;
      if (evidence.weight(x, y) == 1) {
        ++seen;
        wrong += (evidence.inside(x, y) > 0.5f) != hit->on_ball;
        EXPECT_TRUE(inside_image);
      } else {
        ++unseen;
        EXPECT_EQ(evidence.weight(x, y), 0.2f);
        EXPECT_EQ(evidence.inside(x, y), 0);
      }
      blind += !visible && evidence.weight(x, y) == 1;
    }
  }
  EXPECT_GT(seen, 8000);
  EXPECT_GT(unseen, 2000);  // the arc's ends see different walls, and each its side of the ball
  // Both only along the ball's rim, 190 pixels long, where a pixel is half ball and half wall.
  EXPECT_LT(wrong, 100);
  EXPECT_LT(blind, 100);
}

}  // namespace
}  // namespace retint
