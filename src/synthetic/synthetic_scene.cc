// SPDX-License-Identifier: BSD-3-Clause
#include "synthetic/synthetic_scene.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "base/error.h"
#include "kernels/common/color_spaces.h"
#include "synthetic/gaussians.h"
#include "synthetic/light.h"
#include "synthetic/points.h"
#include "synthetic/repaint.h"
#include "synthetic/views.h"
#include "synthetic/world.h"

namespace retint {

using namespace synthetic;

namespace {

// Index of a named object that can be selected.
int FindObject(const World& world, const std::string& name) {
  std::string names;
  for (size_t i = 0; i < world.objects.size(); ++i) {
    if (world.objects[i].furniture) continue;
    if (world.objects[i].name == name) return int(i);
    names += (names.empty() ? "" : ", ") + world.objects[i].name;
  }
  throw OptionError("object '" + name + "' is unknown; there are: " + names);
}

void RepaintObjects(World& world, const SyntheticOptions& options,
                    const std::vector<PosedCamera>& cameras) {
  for (const PaintedObject& painted : options.albedo) {
    const auto& color = painted.color;
    const Vec3 albedo(LinearFromSrgb(color[0]), LinearFromSrgb(color[1]), LinearFromSrgb(color[2]));
    Repaint(world, FindObject(world, painted.object), albedo, cameras);
  }
}

}  // namespace

void SyntheticOptions::Check() const {
  CheckOption(preset == "still-life", "preset '" + preset + "' is unknown; there is: still-life");
  CheckOption(width >= 16 && width <= 4096, "width must be 16 to 4096 pixels");
  CheckOption(height >= 16 && height <= 4096, "height must be 16 to 4096 pixels");
  CheckOption(views >= 3 && views <= 500, "views must be 3 to 500");
  CheckOption(point_noise >= 0 && point_noise <= 10, "point noise must be 0 to 10 pixels");
  CheckOption(sparse_points >= 0 && sparse_points <= 1000000, "sparse points must be 0 to 1000000");
  CheckOption(wall_bias >= 0 && wall_bias <= 0.2, "wall bias must be 0 to 0.2");
  CheckOption(floaters >= 0 && floaters <= 100000, "floaters must be 0 to 100000");
  const World world = albedo.empty() ? World() : MakeStillLife(seed);
  for (const PaintedObject& painted : albedo) {
    FindObject(world, painted.object);
    for (const float value : painted.color) {
      CheckOption(value >= 0 && value <= 1, "colors of objects must be 0 to 1");
    }
  }
}

SyntheticScene MakeSyntheticScene(const SyntheticOptions& options, Monitor& monitor) {
  options.Check();
  World world = MakeStillLife(options.seed);
  const Lighting lighting(world, std::clamp(640.0 / options.width, 1.0, 4.0), monitor);

  SyntheticScene scene;
  // The Gaussians reach a little beyond the images: some views are traced wider for them.
  std::vector<TracedView> views, wide_views;
  const size_t stride = std::clamp<size_t>(size_t(options.views) / 6, 1, 4);
  const int padding = std::max(2, options.width * 2 / 25);
  const auto cameras = MakeArc(options);
  RepaintObjects(world, options, cameras);  // after the light is baked
  scene.reconstruction.cameras[1] = cameras.front().camera;
  for (size_t i = 0; i < cameras.size(); ++i) {
    monitor.Step("photos", double(i), double(cameras.size()));
    const bool wide = i % stride == 0 || i + 1 == cameras.size();
    wide_views.push_back(TraceView(world, lighting, cameras[i], wide ? padding : 0));
    views.push_back(Crop(wide_views.back()));
    char name[16];
    std::snprintf(name, sizeof(name), "%03d.png", int(i));
    views.back().truth.name = name;
    View& view = scene.reconstruction.views[ViewId(i + 1)];
    view.id = ViewId(i + 1);
    view.name = name;
    view.camera_id = 1;
    view.cam_from_world = cameras[i].cam_from_world;
  }
  scene.model = MakeGaussians(world, lighting, wide_views, options, monitor);
  wide_views.clear();
  monitor.Step("points", 0, 1);
  AddSparsePoints(world, views, options, &scene.reconstruction);
  scene.whole_views = FindWholeViews(world, views);
  for (size_t i = 0; i < world.objects.size(); ++i) {
    scene.object_names.push_back(world.objects[i].name);
    if (!world.objects[i].furniture) scene.still_life.push_back(int(i));
  }
  for (TracedView& view : views) scene.views.push_back(std::move(view.truth));
  monitor.Step("points", 1, 1);
  return scene;
}

}  // namespace retint
