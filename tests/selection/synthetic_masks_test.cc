// SPDX-License-Identifier: BSD-3-Clause
// The masks' target on the sample scene: every object, painted in one view that sees it whole,
// against the exact object ids of the others.
#include <algorithm>

#include <gtest/gtest.h>

#include "depth/factory.h"
#include "selection/mask_projector.h"
#include "selection/registration.h"
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

double Iou(const Mask& mask, const Mask& truth) {
  int64_t both = 0, any = 0;
  for (size_t i = 0; i < truth.data.size(); ++i) {
    const bool a = mask.data[i] >= 128, b = truth.data[i] >= 128;
    both += a && b;
    any += a || b;
  }
  return any > 0 ? double(both) / double(any) : 1;
}

TEST(SyntheticMasks, EveryObjectIsFoundFromEveryViewThatSeesItWhole) {
  SyntheticOptions options;
  options.views = 9;
  Monitor monitor;
  const SyntheticScene scene = MakeSyntheticScene(options, monitor);
  Renderer renderer(CreateBackend("cpu"), scene.model);
  const GaussianGraph graph(scene.model, monitor);
  const auto estimator = MakeDepthEstimator("stereo-hv", renderer);
  std::vector<const View*> views;
  std::vector<DepthMap> depths;
  for (const auto& view : scene.views) {
    views.push_back(scene.reconstruction.FindView(view.name));
    depths.push_back(estimator->Estimate(scene.reconstruction.Posed(*views.back()), monitor).depth);
  }
  ASSERT_GE(scene.still_life.size(), 6u);
  for (const int object : scene.still_life) {
    const std::string& name = scene.object_names[size_t(object)];
    ASSERT_GE(scene.whole_views[size_t(object)].size(), 2u) << name;
    for (const int painted : scene.whole_views[size_t(object)]) {
      const View& view = *views[size_t(painted)];
      const PosedCamera posed = scene.reconstruction.Posed(view);
      const Mask paint = MaskOf(scene.views[size_t(painted)], object);
      const DepthMap& depth = depths[size_t(painted)];
      SelectionCloud cloud = MakeCloud(posed, view.name, paint, depth, {}, {}, {});
      Register(cloud, posed, &view, paint, depth, scene.reconstruction, {});
      const ProjectedMasks masks =
          ProjectMasks(cloud, {{view.name, posed, paint}}, scene.reconstruction, views, renderer,
                       {}, monitor, &graph);
      double sum = 0;
      int counted = 0;
      for (size_t v = 0; v < views.size(); ++v) {
        const Mask truth = MaskOf(scene.views[v], object);
        if (int(v) == painted) continue;
        if (std::count(truth.data.begin(), truth.data.end(), 255) < kLeastPixels) continue;
        sum += Iou(masks.masks.at(views[v]->name), truth);
        ++counted;
      }
      ASSERT_GE(counted, 4) << name;
      EXPECT_GE(sum / counted, kLeastIou) << name << " from " << view.name;
      RecordProperty(name + "." + view.name, std::to_string(sum / counted));
    }
  }
}

}  // namespace
}  // namespace retint
