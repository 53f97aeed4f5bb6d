// SPDX-License-Identifier: BSD-3-Clause
#include "synthetic/synthetic_scene.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "base/error.h"
#include "kernels/common/color_spaces.h"
#include "synthetic/gaussians.h"
#include "synthetic/light.h"
#include "synthetic/points.h"
#include "synthetic/repaint.h"
#include "synthetic/tracer.h"
#include "synthetic/views.h"
#include "synthetic/world.h"

namespace retint {

using namespace synthetic;

namespace {

// The pictures that a scene is made from, all of which are kept until its Gaussians are there, and
// what a pixel of them takes with the candidates for Gaussians.
constexpr double kMostMegapixels = 200;
constexpr double kBytesPerPixel = 75;

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

Room RoomOf(const SyntheticOptions& options) {
  return options.around ? Room::kOpen : options.bare_walls ? Room::kBare : Room::kPapered;
}

// Small pictures show less of it.
double LightCoarseness(const SyntheticOptions& options) {
  return std::clamp(640.0 / options.width, 1.0, 4.0);
}

void RepaintObjects(World& world, const SyntheticOptions& options,
                    const std::vector<PosedCamera>& cameras) {
  for (const PaintedObject& painted : options.albedo) {
    if (!painted.picture.Empty()) {
      Paste(world, FindObject(world, painted.object), painted.picture);
      continue;
    }
    const auto& color = painted.color;
    const Vec3 albedo(LinearFromSrgb(color[0]), LinearFromSrgb(color[1]), LinearFromSrgb(color[2]));
    Repaint(world, FindObject(world, painted.object), albedo, cameras);
  }
}

}  // namespace

void SyntheticOptions::Describe(OptionList& list) {
  list.push_back({.name = "preset",
                  .member = ChoiceOf(preset, {"still-life"}),
                  .help = "scene",
                  .flag = "--preset"});
  list.push_back({.name = "width",
                  .member = &width,
                  .range = OptionRange::Closed(16, 4096),
                  .help = "width of the photos",
                  .unit = "pixels",
                  .flag = "--width"});
  list.push_back({.name = "height",
                  .member = &height,
                  .range = OptionRange::Closed(16, 4096),
                  .help = "height of the photos",
                  .unit = "pixels",
                  .flag = "--height"});
  list.push_back({.name = "views",
                  .member = &views,
                  .range = OptionRange::Closed(3, 500),
                  .help = "number of photos, on an arc about the table",
                  .flag = "--views"});
  list.push_back({.name = "around",
                  .member = &around,
                  .help = "cameras all around the table, which then stands in the open, without "
                          "walls",
                  .flag = "--around"});
  list.push_back({.name = "detail",
                  .member = &detail,
                  .range = OptionRange::Closed(1, 4),
                  .help = "how many times finer the Gaussians are than the photos show: they are "
                          "made from photos of this many times the size",
                  .flag = "--detail"});
  list.push_back({.name = "point_noise",
                  .member = &point_noise,
                  .range = OptionRange::Closed(0, 10),
                  .help = "standard deviation of the sparse points' observations",
                  .unit = "pixels",
                  .flag = "--point-noise"});
  list.push_back({.name = "sparse_points",
                  .member = &sparse_points,
                  .range = OptionRange::Closed(0, 1000000),
                  .help = "sparse points, at most",
                  .flag = "--sparse-points"});
  list.push_back({.name = "wall_bias",
                  .member = &wall_bias,
                  .range = OptionRange::Closed(0, 0.2),
                  .help = "largest relative depth error of the Gaussians on a textureless wall",
                  .flag = "--wall-bias"});
  DescribeFlaws(list);
}

void SyntheticOptions::DescribeFlaws(OptionList& list) {
  list.push_back({.name = "depth_wave",
                  .member = &depth_wave,
                  .range = OptionRange::Closed(0, 0.2),
                  .help = "flaw: largest relative depth error of the Gaussians on every surface, "
                          "which varies smoothly",
                  .flag = "--depth-wave"});
  list.push_back({.name = "depth_noise",
                  .member = &depth_noise,
                  .range = OptionRange::Closed(0, 0.2),
                  .help = "flaw: standard deviation of the relative depth error that each Gaussian "
                          "has by itself",
                  .flag = "--depth-noise"});
  list.push_back({.name = "floaters",
                  .member = &floaters,
                  .range = OptionRange::Closed(0, 100000),
                  .help = "stray Gaussians in free space",
                  .flag = "--floaters"});
  list.push_back({.name = "floater_opacity",
                  .member = &floater_opacity,
                  .range = OptionRange::Closed(0.02, 0.99),
                  .help = "opacity of the most opaque stray Gaussian; the least opaque has 0.02",
                  .flag = "--floater-opacity"});
  list.push_back({.name = "cloud_scale",
                  .member = &cloud_scale,
                  .range = OptionRange::Closed(0.5, 2),
                  .help =
                      "flaw: size of the sparse points' cloud, about the middle of the cameras; "
                      "cameras and Gaussians stay",
                  .flag = "--cloud-scale"});
  list.push_back({.name = "cloud_shift",
                  .member = &cloud_shift,
                  .range = OptionRange::Closed(-1, 1),
                  .help = "flaw: move the sparse points to the right and away from the viewer, by "
                          "this length each",
                  .unit = "m",
                  .flag = "--cloud-shift"});
  list.push_back({.name = "bare_walls",
                  .member = &bare_walls,
                  .help = "flaw: no wallpaper, so that nothing tells where the wall is",
                  .flag = "--bare-walls"});
}

void SyntheticOptions::Check() const {
  CheckRanges(*this);
  CheckOption(!around || !bare_walls, "a table in the open has no walls to be bare");
  // Finer Gaussians are made from pictures of their own.
  const int pictures = detail == 1 ? 1 : 1 + detail * detail;
  const double megapixels = 1e-6 * width * height * views * pictures;
  CheckOption(megapixels <= kMostMegapixels,
              fmt::format("{} views of {} by {} pixels with a detail of {} would take {:.0f} GB of "
                          "memory to make, and {:.0f} GB are the most: ask for fewer or smaller "
                          "views, or for less detail",
                          views, width, height, detail, 1e-3 * kBytesPerPixel * megapixels,
                          1e-3 * kBytesPerPixel * kMostMegapixels));
  const World world = albedo.empty() ? World() : MakeStillLife(seed, RoomOf(*this));
  std::set<std::string> objects;
  for (const PaintedObject& painted : albedo) {
    FindObject(world, painted.object);
    CheckOption(objects.insert(painted.object).second,
                "object '" + painted.object + "' gets a color or picture twice");
    for (const float value : painted.color) {
      CheckOption(value >= 0 && value <= 1, "colors of objects must be 0 to 1");
    }
  }
}

synthetic::SyntheticTracer::SyntheticTracer(const SyntheticOptions& options, Monitor& monitor)
    : world_(MakeStillLife(options.seed, RoomOf(options))),
      lighting_(world_, LightCoarseness(options), monitor) {
  RepaintObjects(world_, options, MakeArc(options));  // after the light is baked
}

SyntheticScene MakeSyntheticScene(const SyntheticOptions& options, Monitor& monitor) {
  options.Check();
  World world = MakeStillLife(options.seed, RoomOf(options));
  const Lighting lighting(world, LightCoarseness(options), monitor);

  SyntheticScene scene;
  // The Gaussians reach a little beyond the images: some views are traced wider for them.
  std::vector<TracedView> views, wide_views;
  const size_t stride = std::clamp<size_t>(size_t(options.views) / 6, 1, 4);
  SyntheticOptions detailed = options;
  detailed.width *= options.detail;
  detailed.height *= options.detail;
  const auto padding_of = [](const SyntheticOptions& of) { return std::max(2, of.width * 2 / 25); };
  const auto cameras = MakeArc(options), detailed_cameras = MakeArc(detailed);
  RepaintObjects(world, options, cameras);  // after the light is baked
  scene.reconstruction.cameras[1] = cameras.front().camera;
  for (size_t i = 0; i < cameras.size(); ++i) {
    monitor.Step("photos", double(i), double(cameras.size()));
    const bool wide = i % stride == 0 || i + 1 == cameras.size();
    const auto trace = [&](const SyntheticOptions& of, const PosedCamera& camera) {
      return TraceView(world, lighting, camera, wide ? padding_of(of) : 0);
    };
    wide_views.push_back(trace(detailed, detailed_cameras[i]));
    views.push_back(options.detail == 1 ? Crop(wide_views.back())
                                        : Crop(trace(options, cameras[i])));
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
