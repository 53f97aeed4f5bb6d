// SPDX-License-Identifier: BSD-3-Clause
#include "synthetic/synthetic_scene.h"

#include <algorithm>
#include <set>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "base/error.h"
#include "kernels/common/color_spaces.h"
#include "scene/camera_projection.h"
#include "scene/undistortion.h"
#include "synthetic/views.h"

namespace retint {

using namespace synthetic;

namespace {

// The most pixels in a scene's pictures, which are all kept until its Gaussians are made, and the
// memory that a pixel needs with its candidates for Gaussians.
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
    const int object = FindObject(world, painted.object);
    const auto& c = painted.color;
    if (painted.picture.Empty()) {
      Repaint(world, object, {LinearFromSrgb(c[0]), LinearFromSrgb(c[1]), LinearFromSrgb(c[2])},
              cameras);
    } else {
      Paste(world, object, painted.picture);
    }
  }
}

}  // namespace

void SyntheticOptions::Describe(OptionList& list) {
  const auto add = [&](std::string name, auto member, OptionRange range, std::string help,
                       std::string unit = "", OptionTier tier = OptionTier::kOccasional) {
    list.push_back({.name = std::move(name),
                    .member = member,
                    .range = range,
                    .help = std::move(help),
                    .unit = std::move(unit),
                    .tier = tier});
  };
  constexpr OptionTier kEveryday = OptionTier::kEveryday;
  using R = OptionRange;
  add("width", &width, R::Closed(16, 4096), "width of the photos", "pixels", kEveryday);
  add("height", &height, R::Closed(16, 4096), "height of the photos", "pixels", kEveryday);
  add("photos", &views, R::Closed(3, 500), "number of photos, on an arc about the table", "",
      kEveryday);
  add("around", &around, {},
      "cameras all around the table, which then stands in the open, without walls", "", kEveryday);
  add("detail", &detail, R::Closed(1, 4),
      "how many times finer the Gaussians are than the photos show: they are made from photos of "
      "this many times the size");
  add("point_noise", &point_noise, R::Closed(0, 10),
      "standard deviation of the sparse points' observations", "pixels");
  add("sparse_points", &sparse_points, R::Closed(0, 1000000), "sparse points, at most");
  add("wall_bias", &wall_bias, R::Closed(0, 0.2),
      "largest relative depth error of the Gaussians on a textureless wall");
  add("depth_wave", &depth_wave, R::Closed(0, 0.2),
      "flaw: largest relative depth error of the Gaussians on every surface, which varies "
      "smoothly");
  add("depth_noise", &depth_noise, R::Closed(0, 0.2),
      "flaw: standard deviation of the relative depth error that each Gaussian has by itself");
  add("floaters", &floaters, R::Closed(0, 100000), "stray Gaussians in free space");
  add("floater_opacity", &floater_opacity, R::Closed(0.02, 0.99),
      "opacity of the most opaque stray Gaussian; the least opaque has 0.02");
  add("cloud_scale", &cloud_scale, R::Closed(0.5, 2),
      "flaw: size of the sparse points' cloud, about the middle of the cameras; cameras and "
      "Gaussians stay");
  add("cloud_shift", &cloud_shift, R::Closed(-1, 1),
      "flaw: move the sparse points to the right and away from the viewer, by this length each",
      "m");
  add("bare_walls", &bare_walls, {}, "flaw: no wallpaper, so that nothing tells where the wall is");
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
  const auto cameras = MakeArc(options), detailed_cameras = MakeArc(detailed);
  RepaintObjects(world, options, cameras);  // after the light is baked
  scene.reconstruction.cameras[1] = cameras.front().camera;
  for (size_t i = 0; i < cameras.size(); ++i) {
    monitor.Step("photos", double(i), double(cameras.size()));
    const bool wide = i % stride == 0 || i + 1 == cameras.size();
    const auto trace = [&](const PosedCamera& camera) {
      return TraceView(world, lighting, camera,
                       wide ? std::max(2, camera.camera.width * 2 / 25) : 0);
    };
    wide_views.push_back(trace(detailed_cameras[i]));
    views.push_back(Crop(options.detail == 1 ? wide_views.back() : trace(cameras[i])));
    View& view = scene.reconstruction.views[ViewId(i + 1)];
    view.id = ViewId(i + 1);
    view.name = views.back().truth.name = fmt::format("{:03}.png", i);
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

Camera MakeLens(std::string_view model, const Camera& camera) {
  const CameraModelInfo* info = FindCameraModel(model);
  Camera lens = camera;
  const double f = camera.fx(), cx = camera.cx(), cy = camera.cy();
  switch (info ? info->id : CameraModelId::kPinhole) {
    case CameraModelId::kSimpleRadial:
      lens.params = {f, cx, cy, -0.15};
      break;
    case CameraModelId::kOpenCV:
      lens.params = {f, f, cx, cy, -0.2, 0.05, 1e-3, -1e-3};
      break;
    case CameraModelId::kOpenCVFisheye:
      lens.params = {f, f, cx, cy, -0.02, 0.003, 0, 0};
      break;
    case CameraModelId::kEquirectangular:
      lens.width = 4 * camera.width;
      lens.height = 2 * camera.width;
      lens.params = {double(lens.width), double(lens.height)};
      break;
    default:
      throw OptionError("there is no lens '" + std::string(model) +
                        "'. Use SIMPLE_RADIAL, OPENCV, OPENCV_FISHEYE or EQUIRECTANGULAR");
  }
  lens.model = info->id;
  return lens;
}

void TakeThroughLens(Camera lens, const SyntheticOptions& options, SyntheticScene* scene,
                     Monitor& monitor) {
  World world = MakeStillLife(options.seed, RoomOf(options));
  const Lighting lighting(world, LightCoarseness(options), monitor);
  RepaintObjects(world, options, MakeArc(options));
  Reconstruction& reconstruction = scene->reconstruction;
  const auto [id, pinhole] = *reconstruction.cameras.begin();
  lens.id = id;
  const CameraProjection projection(lens);
  const bool distance = Undistort(lens).DepthIsDistance();
  size_t done = 0;
  for (auto& [view_id, view] : reconstruction.views) {
    monitor.Step("photos", double(done), double(scene->views.size()));
    const Rigid3d& pose = view.cam_from_world;
    const Eigen::Quaterniond world_from_cam = pose.rotation.conjugate();
    const auto ray_of = [&](double x, double y) -> std::optional<Ray> {
      const auto ray = projection.CamFromImg({x, y});
      if (!ray) return std::nullopt;
      const Vec3 direction = distance ? *ray : Vec3(*ray / ray->z());
      return Ray{pose.OriginInSource(), world_from_cam * direction};
    };
    SyntheticView& truth = scene->views[done++];
    truth = TraceRays(world, lighting, lens.width, lens.height, ray_of).truth;
    truth.name = view.name;
    for (Observation& observation : view.observations) {
      const Eigen::Vector2d flat = pinhole.CamFromImg(observation.xy).value();
      observation.xy = projection.ImgFromCam({flat.x(), flat.y(), 1}).value();
    }
  }
  reconstruction.cameras.at(id) = lens;
}

}  // namespace retint
