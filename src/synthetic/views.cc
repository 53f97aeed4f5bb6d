// SPDX-License-Identifier: BSD-3-Clause
#include "synthetic/views.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/parallel.h"
#include "scene/grid_rect.h"
#include "synthetic/noise.h"

namespace retint::synthetic {
namespace {

constexpr double kPi = std::numbers::pi;

// Sub-pixel offsets from the center: four on a rotated grid for every pixel, eight more where
// pixels differ.
constexpr double kOffsets[12][2] = {{-0.125, -0.375}, {0.375, -0.125}, {0.125, 0.375},
                                    {-0.375, 0.125},  {-0.42, -0.45},  {0.20, -0.46},
                                    {0.45, -0.36},    {-0.05, -0.10},  {0.10, 0.08},
                                    {-0.44, 0.42},    {-0.12, 0.46},   {0.44, 0.40}};

}  // namespace

TracedView TraceRays(const World& world, const Lighting& lighting, int width, int height,
                     const RayOf& ray_of) {
  TracedView view;
  view.truth.photo = Image(width, height);
  view.truth.depth = DepthMap(width, height);
  view.truth.object_ids = PixelArray<uint8_t, 1>(width, height);
  view.truth.normals = PixelArray<float, 3>(width, height);
  view.parts = PixelArray<int16_t, 1>(width, height, -1);
  ParallelTasks(int64_t(height), [&](int y) {
    for (int x = 0; x < width; ++x) {
      Hit hit;
      const std::optional<Ray> ray = ray_of(x + 0.5, y + 0.5);
      if (!ray || !world.Intersect(*ray, 1e-6, 1e3, &hit)) continue;
      view.parts(x, y) = int16_t(hit.shape);
      view.truth.depth(x, y) = float(hit.t);
      view.truth.object_ids(x, y) = uint8_t(world.parts[size_t(hit.shape)].object);
      for (int c = 0; c < 3; ++c) view.truth.normals(x, y, c) = float(hit.face[c]);
    }
  });
  const auto differs = [&](int x, int y, int nx, int ny) {
    if (!view.parts.Contains(nx, ny)) return false;
    if (view.parts(x, y) != view.parts(nx, ny)) return true;
    const float a = view.truth.depth(x, y), b = view.truth.depth(nx, ny);
    return std::abs(a - b) > 0.02f * a;
  };
  ParallelTasks(int64_t(height), [&](int y) {
    for (int x = 0; x < width; ++x) {
      bool edge = false;
      for (int k = 0; k < 9 && !edge; ++k) edge = differs(x, y, x + k % 3 - 1, y + k / 3 - 1);
      const int samples = edge ? 12 : 4;
      Vec3 sum = Vec3::Zero();
      for (int k = 0; k < samples; ++k) {
        const std::optional<Ray> ray = ray_of(x + 0.5 + kOffsets[k][0], y + 0.5 + kOffsets[k][1]);
        // Inside a part nothing else needs a look.
        if (ray) sum += lighting.Color(*ray, edge ? -1 : view.parts(x, y));
      }
      for (int c = 0; c < 3; ++c) view.truth.photo(x, y, c) = float(sum[c] / samples);
    }
  });
  return view;
}

Vec3 MiddleOfCameras(const std::vector<TracedView>& views) {
  Vec3 eye = Vec3::Zero();
  for (const TracedView& view : views) eye += view.camera.Center() / double(views.size());
  return eye;
}

std::vector<PosedCamera> MakeArc(const SyntheticOptions& options) {
  const double focal =
      0.5 * std::max(options.width, options.height * 4 / 3) / std::tan(21.0 * kPi / 180);
  const Camera camera = Camera::Pinhole(1, options.width, options.height, focal, focal,
                                        0.5 * options.width, 0.5 * options.height);
  std::vector<PosedCamera> cameras;
  Random random(HashOf(options.seed, 11));
  for (int i = 0; i < options.views; ++i) {
    const double s = options.views > 1 ? double(i) / (options.views - 1) : 0.5;
    const double azimuth =
        options.around ? 2 * kPi * i / options.views : (-46 + 66 * s) * kPi / 180;
    const double height =
        1.30 + 0.24 * std::sin(2 * kPi * 2.5 * s + 0.6) + random.Uniform(-0.02, 0.02);
    const double distance = 1.92 + 0.12 * std::cos(2 * kPi * 1.5 * s) + random.Uniform(-0.03, 0.03);
    const Vec3 target(0.01 + random.Uniform(-0.02, 0.02), -0.885 + random.Uniform(-0.015, 0.015),
                      0.02);
    const Vec3 center(distance * std::sin(azimuth), -height, -distance * std::cos(azimuth));
    const Vec3 forward = (target - center).normalized();
    const Vec3 right = Vec3(0, 1, 0).cross(forward).normalized();
    Eigen::Matrix3d cam_from_world;
    cam_from_world.row(0) = right;
    cam_from_world.row(1) = forward.cross(right);
    cam_from_world.row(2) = forward;
    PosedCamera posed;
    posed.camera = camera;
    posed.cam_from_world.rotation = Eigen::Quaterniond(cam_from_world).normalized();
    posed.cam_from_world.translation = -(posed.cam_from_world.rotation * center);
    cameras.push_back(posed);
  }
  return cameras;
}

TracedView TraceView(const World& world, const Lighting& lighting, const PosedCamera& actual,
                     int padding) {
  const Camera& c = actual.camera;
  const PosedCamera camera = {Camera::Pinhole(c.id, c.width + 2 * padding, c.height + 2 * padding,
                                              c.fx(), c.fy(), c.cx() + padding, c.cy() + padding),
                              actual.cam_from_world};
  TracedView view = TraceRays(world, lighting, camera.camera.width, camera.camera.height,
                              [&](double x, double y) { return PixelRay(camera, x, y); });
  view.camera = camera;
  view.padding = padding;
  return view;
}

TracedView Crop(const TracedView& view) {
  const int p = view.padding;
  const Camera& c = view.camera.camera;
  const int width = c.width - 2 * p, height = c.height - 2 * p;
  const auto cut = [&](const auto& from) {
    return retint::Crop(from, {.x = p, .y = p, .width = width, .height = height});
  };
  return {{Camera::Pinhole(c.id, width, height, c.fx(), c.fy(), c.cx() - p, c.cy() - p),
           view.camera.cam_from_world},
          {view.truth.name, cut(view.truth.photo), cut(view.truth.depth),
           cut(view.truth.object_ids), cut(view.truth.normals)},
          cut(view.parts)};
}

std::optional<Vec2> Sees(const TracedView& view, int part, const Vec3& point) {
  const auto projected = view.camera.Project(point);
  if (!projected) return std::nullopt;
  const double x = projected->x(), y = projected->y();
  const int width = view.parts.width, height = view.parts.height;
  if (!(x >= 0 && y >= 0 && x < width && y < height)) return std::nullopt;
  const int px = int(x), py = int(y);
  if (view.parts(px, py) != part) return std::nullopt;
  // Within a pixel the surface's depth changes with its slant.
  const double z = view.truth.depth(px, py);
  const Ray ray = PixelRay(view.camera, px + 0.5, py + 0.5);
  const double slant =
      std::max(0.05, std::abs(view.NormalAt(px, py).dot(ray.direction.normalized())));
  if (std::abs(projected->z() - z) >= 1.5 * z / view.camera.camera.fx() / slant) {
    return std::nullopt;
  }
  return Vec2(x, y);
}

std::vector<std::vector<int>> FindWholeViews(const World& world,
                                             const std::vector<TracedView>& views) {
  std::vector<std::vector<int>> whole(world.objects.size());
  ParallelTasks(int64_t(whole.size()), [&](size_t i) {
    const Object& object = world.objects[i];
    for (size_t v = 0; v < views.size() && !object.furniture; ++v) {
      const TracedView& view = views[v];
      // The object's rectangle in the image, from the corners of its parts' boxes.
      Eigen::AlignedBox2d rectangle;
      for (const int part : object.parts) {
        for (int corner = 0; corner < 8; ++corner) {
          const auto p = view.camera.Project(world.parts[size_t(part)].shape->bounds.corner(
              Eigen::AlignedBox3d::CornerType(corner)));
          if (p) rectangle.extend(Vec2(p->x(), p->y()));
        }
      }
      const Vec2 low = rectangle.min(), high = rectangle.max();
      if (low.x() < 1 || low.y() < 1 || high.x() > view.parts.width - 1 ||
          high.y() > view.parts.height - 1) {
        continue;
      }
      int64_t seen = 0, hidden = 0;
      for (int y = int(low.y()); y <= int(high.y()); ++y) {
        for (int x = int(low.x()); x <= int(high.x()); ++x) {
          Hit hit;
          if (view.truth.object_ids(x, y) == i) {
            ++seen;
          } else {
            hidden += world.IntersectObject(object, PixelRay(view.camera, x + 0.5, y + 0.5), 1e-6,
                                            1e3, &hit);
          }
        }
      }
      if (seen > 0 && hidden * 33 <= seen) whole[i].push_back(int(v));
    }
  });
  return whole;
}

}  // namespace retint::synthetic
