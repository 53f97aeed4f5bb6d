// SPDX-License-Identifier: BSD-3-Clause
// The masks' target on the sample scene: every object, painted in one view that sees it whole,
// against the exact object ids of the others.
#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "depth/factory.h"
#include "selection/lifted_surfaces.h"
#include "selection/mask_projector.h"
#include "selection/mask_score.h"
#include "selection/registration.h"
#include "selection/views_between.h"
#include "synthetic/synthetic_scene.h"

namespace retint {
namespace {

constexpr double kLeastIou = 0.90;
constexpr int64_t kLeastPixels = 200;  // of a view that counts

Mask MaskOf(const SyntheticView& view, int object) {
  Mask mask(view.object_ids.width, view.object_ids.height);
  std::transform(view.object_ids.data.begin(), view.object_ids.data.end(), mask.data.begin(),
                 [&](uint8_t id) { return id == object ? 255 : 0; });
  return mask;
}

// A test an object, so that none takes long.
constexpr int kObjects = 6;

class SyntheticMasks : public testing::TestWithParam<int> {
 protected:
  SyntheticMasks() {
    SyntheticOptions options;
    options.views = 9;
    scene_ = MakeSyntheticScene(options, monitor_);
    renderer_ = std::make_unique<Renderer>(CreateBackend("cpu"), scene_.model);
    for (const auto& view : scene_.views) {
      views_.push_back(scene_.reconstruction.FindView(view.name));
    }
    graph_ = std::make_unique<GaussianGraph>(
        scene_.model, monitor_, std::nullopt,
        LiftSurfaces(*renderer_, scene_.model, scene_.reconstruction, views_, monitor_));
  }

  // Painted in the view `painted`: mean IoU over the other views that show enough of the object,
  // and their number.
  std::pair<double, int> MeanIou(int object, int painted) {
    const View& view = *views_[size_t(painted)];
    const PosedCamera posed = scene_.reconstruction.Posed(view);
    const Mask paint = MaskOf(scene_.views[size_t(painted)], object);
    const DepthMap depth =
        MakeDepthEstimator("stereo-hv", *renderer_)->Estimate(posed, monitor_).depth;
    SelectionCloud cloud = MakeCloud(posed, view.name, paint, depth, {}, {}, {});
    Register(cloud, posed, &view, paint, depth, scene_.reconstruction, {});
    const ProjectedMasks masks =
        ProjectMasks(cloud, {{view.name, posed, paint}}, scene_.reconstruction, views_, *renderer_,
                     {}, monitor_, graph_.get());
    double sum = 0;
    int counted = 0;
    for (size_t v = 0; v < views_.size(); ++v) {
      const Mask truth = MaskOf(scene_.views[v], object);
      if (int(v) == painted) continue;
      if (std::count(truth.data.begin(), truth.data.end(), 255) < kLeastPixels) continue;
      sum += *Iou(masks.masks.at(views_[v]->name), truth);
      ++counted;
    }
    return {sum / std::max(1, counted), counted};
  }

  Monitor monitor_;
  SyntheticScene scene_;
  std::unique_ptr<Renderer> renderer_;
  std::unique_ptr<GaussianGraph> graph_;
  std::vector<const View*> views_;
};

TEST_P(SyntheticMasks, AnObjectIsFoundFromEveryViewThatSeesItWhole) {
  ASSERT_EQ(scene_.still_life.size(), size_t(kObjects));
  const int object = scene_.still_life[size_t(GetParam())];
  const std::string& name = scene_.object_names[size_t(object)];
  ASSERT_GE(scene_.whole_views[size_t(object)].size(), 2u) << name;
  for (const int painted : scene_.whole_views[size_t(object)]) {
    const auto [iou, counted] = MeanIou(object, painted);
    const std::string& view = views_[size_t(painted)]->name;
    ASSERT_GE(counted, 4) << name;
    EXPECT_GE(iou, kLeastIou) << name << " from " << view;
    RecordProperty(name + "." + view, std::to_string(iou));
  }
}

INSTANTIATE_TEST_SUITE_P(Objects, SyntheticMasks, testing::Range(0, kObjects));

// Objects painted a few pixels too small or too large, and a part of one, from one of the cameras
// all around.
class PaintThatMisses : public testing::Test {
 protected:
  PaintThatMisses() {
    SyntheticOptions options;
    options.around = true;
    options.views = 10;
    options.width = 400, options.height = 300;
    options.seed = 3;
    scene_ = MakeSyntheticScene(options, monitor_);
    renderer_ = std::make_unique<Renderer>(CreateBackend("cpu"), scene_.model);
    views_ = scene_.reconstruction.ViewsByName();
    graph_ = std::make_unique<GaussianGraph>(
        scene_.model, monitor_, std::nullopt,
        LiftSurfaces(*renderer_, scene_.model, scene_.reconstruction, views_, monitor_));
  }

  int ObjectNamed(const char* name) const {
    const auto found = std::find(scene_.object_names.begin(), scene_.object_names.end(), name);
    return int(found - scene_.object_names.begin());
  }

  // The masks of all views, painted in the first.
  std::map<std::string, Mask> Find(const Mask& paint, double slack) {
    const PosedCamera posed = scene_.reconstruction.Posed(*views_[0]);
    const SelectionCloud cloud =
        MakeCloud(posed, views_[0]->name, paint, scene_.views[0].depth, {}, {}, {});
    ProjectorOptions options;
    options.paint_slack = slack;
    return ProjectMasks(cloud, {{views_[0]->name, posed, paint}}, scene_.reconstruction, views_,
                        *renderer_, options, monitor_, graph_.get())
        .masks;
  }

  double MeanIou(int object, const Mask& paint, double slack) {
    const auto masks = Find(paint, slack);
    double sum = 0;
    int counted = 0;
    for (size_t v = 1; v < views_.size(); ++v) {
      const Mask truth = MaskOf(scene_.views[v], object);
      if (std::count(truth.data.begin(), truth.data.end(), 255) < kLeastPixels) continue;
      sum += *Iou(masks.at(views_[v]->name), truth);
      ++counted;
    }
    return sum / std::max(1, counted);
  }

  Monitor monitor_;
  SyntheticScene scene_;
  std::unique_ptr<Renderer> renderer_;
  std::unique_ptr<GaussianGraph> graph_;
  std::vector<const View*> views_;
};

Mask Inverted(Mask mask) {
  for (uint8_t& value : mask.data) value = uint8_t(255 - value);
  return mask;
}

// `mask` without the pixels at most `pixels` from its border.
Mask Eroded(Mask mask, int pixels) {
  for (; pixels > 0; --pixels) {
    const Mask before = mask;
    for (int y = 0; y < mask.height; ++y) {
      for (int x = 0; x < mask.width; ++x) {
        for (const auto& [dx, dy] : {std::pair(1, 0), {-1, 0}, {0, 1}, {0, -1}}) {
          if (before.Contains(x + dx, y + dy) && before(x + dx, y + dy) < 128) mask(x, y) = 0;
        }
      }
    }
  }
  return mask;
}

TEST_F(PaintThatMisses, TooSmallFindsTheObjectAsTheTrueMaskDoes) {
  for (const char* name : {"pot", "box"}) {
    const int object = ObjectNamed(name);
    const Mask truth = MaskOf(scene_.views[0], object), small = Eroded(truth, 2);
    const double exact = MeanIou(object, truth, 0.01);
    EXPECT_GT(exact, MeanIou(object, truth, 0) - 0.01) << name;  // measured: 0.006 on the pot
    EXPECT_GT(MeanIou(object, small, 0.01), exact - 0.03) << name;
    EXPECT_LT(MeanIou(object, small, 0), exact - 0.05) << name;  // the paint as it is
  }
}

TEST_F(PaintThatMisses, TooLargeIsTakenBackToTheEdge) {
  for (const char* name : {"ball", "box"}) {
    const int object = ObjectNamed(name);
    const Mask truth = MaskOf(scene_.views[0], object);
    const Mask large = Inverted(Eroded(Inverted(truth), 3));
    const double exact = MeanIou(object, truth, 0.01);
    const double found = MeanIou(object, large, 0.01), as_painted = MeanIou(object, large, 0);
    EXPECT_GT(found, exact - 0.05) << name;
    EXPECT_GT(found, as_painted + 0.02) << name;
  }
}

TEST_F(PaintThatMisses, APartOfAPlainThingStaysThatPart) {
  const Mask ball = MaskOf(scene_.views[0], ObjectNamed("ball"));
  const Mask part = Eroded(ball, 10);  // its edge is farther away than the slack
  ASSERT_GT(std::count(part.data.begin(), part.data.end(), 255), 100);
  const auto as_painted = Find(part, 0), found = Find(part, 0.01);
  for (const auto& [view, mask] : as_painted) {
    const auto area = [](const Mask& of) {
      return double(std::count_if(of.data.begin(), of.data.end(), [](int v) { return v >= 128; }));
    };
    const double before = area(mask), after = area(found.at(view));
    // A pixel all around a disc of its area, 3.5 being twice the square root of pi.
    EXPECT_LT(after, before + 3.5 * std::sqrt(before) + 10) << view;
  }
}

// Objects on a table with cameras all around it, of which every third takes part: the masks of the
// others are better where views between the four add their evidence.
TEST(SyntheticMasksOfFewCameras, AreBetterWithViewsBetween) {
  Monitor monitor;
  SyntheticOptions options;
  options.around = true;
  options.views = 12;
  options.width = 200, options.height = 150;
  options.seed = 3;
  const SyntheticScene scene = MakeSyntheticScene(options, monitor);
  Renderer renderer(CreateBackend("cpu"), scene.model);
  const std::vector<const View*> views = scene.reconstruction.ViewsByName();
  std::vector<const View*> kept, left_out;
  std::vector<PosedCamera> cameras;
  for (size_t v = 0; v < views.size(); ++v) (v % 3 == 0 ? kept : left_out).push_back(views[v]);
  for (const View* view : kept) cameras.push_back(scene.reconstruction.Posed(*view));
  const GaussianGraph graph(
      scene.model, monitor, std::nullopt,
      LiftSurfaces(renderer, scene.model, scene.reconstruction, kept, monitor));
  double without = 0, with = 0;
  for (const char* name : {"pot", "pear"}) {
    const auto object = int(std::find(scene.object_names.begin(), scene.object_names.end(), name) -
                            scene.object_names.begin());
    ASSERT_LT(size_t(object), scene.object_names.size()) << name;
    const Mask paint = MaskOf(scene.views[0], object);
    const SelectionCloud cloud =
        MakeCloud(cameras[0], kept[0]->name, paint, scene.views[0].depth, {}, {}, {});
    ASSERT_FALSE(cloud.points.empty()) << name;
    const Eigen::Vector3d middle = cloud.points[cloud.points.size() / 2].position.cast<double>();
    const auto added = ViewsBetween(cameras, middle, cameras[0].camera, 20);
    ASSERT_EQ(added.size(), 20u);
    const auto mean_iou = [&](const std::vector<PosedCamera>& more) {
      const ProjectedMasks found =
          ProjectMasks(cloud, {{kept[0]->name, cameras[0], paint}}, scene.reconstruction, kept,
                       renderer, {}, monitor, &graph, left_out, more);
      double sum = 0;
      for (size_t v = 0; v < views.size(); ++v) {
        if (v % 3 != 0) sum += *Iou(found.masks.at(views[v]->name), MaskOf(scene.views[v], object));
      }
      return sum / double(left_out.size());
    };
    without += mean_iou({}) / 2;
    with += mean_iou(added) / 2;
  }
  RecordProperty("without", std::to_string(without));
  RecordProperty("with", std::to_string(with));
  EXPECT_GT(with, without + 0.01);  // 0.022 today
}

}  // namespace
}  // namespace retint
