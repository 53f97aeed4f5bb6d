// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <unordered_set>

#include <Eigen/Cholesky>

#include "base/parallel.h"
#include "synthetic/noise.h"
#include "synthetic/views.h"

namespace retint::synthetic {
namespace {

constexpr int kCell = 6;              // pixels: at most one corner a cell
constexpr double kCornerness = 4e-4;  // smaller eigenvalue of the mean structure tensor
constexpr double kGlossy = 0.04;      // reflectance from which highlights would drag points along
constexpr double kDetected = 0.85;    // share of the views seeing a point that observe it
constexpr double kUnmatched = 0.1;    // observations without a point, per one with a point

struct Corner {
  size_t view;
  int x, y;
  uint64_t order;
};

// Smaller eigenvalue of the structure tensor over 3x3 pixels of one part; 0 elsewhere.
double Cornerness(const TracedView& view, int x, int y) {
  const int part = view.parts(x, y);
  double xx = 0, xy = 0, yy = 0;
  const auto gray = [&](int px, int py) {
    const auto& p = view.truth.photo;
    return 0.3 * p(px, py, 0) + 0.59 * p(px, py, 1) + 0.11 * p(px, py, 2);
  };
  for (int dy = -2; dy <= 2; ++dy) {
    for (int dx = -2; dx <= 2; ++dx) {
      if (view.parts(x + dx, y + dy) != part) return 0;
    }
  }
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      const double gx = 0.5 * (gray(x + dx + 1, y + dy) - gray(x + dx - 1, y + dy));
      const double gy = 0.5 * (gray(x + dx, y + dy + 1) - gray(x + dx, y + dy - 1));
      xx += gx * gx / 9, xy += gx * gy / 9, yy += gy * gy / 9;
    }
  }
  return 0.5 * (xx + yy) - std::hypot(0.5 * (xx - yy), xy);
}

std::vector<Corner> FindCorners(const World& world, const std::vector<TracedView>& views,
                                uint64_t seed) {
  std::vector<std::vector<Corner>> of_view(views.size());
  ParallelTasks(int64_t(views.size()), [&](size_t v) {
    const TracedView& view = views[v];
    const int width = view.parts.width, height = view.parts.height;
    for (int y0 = 2; y0 < height - 2; y0 += kCell) {
      for (int x0 = 2; x0 < width - 2; x0 += kCell) {
        double best = kCornerness;
        Corner corner = {v, -1, -1, 0};
        for (int y = y0; y < std::min(y0 + kCell, height - 2); ++y) {
          for (int x = x0; x < std::min(x0 + kCell, width - 2); ++x) {
            const int part = view.parts(x, y);
            if (part < 0 || world.MaterialOf(part).textureless ||
                world.MaterialOf(part).specular >= kGlossy) {
              continue;
            }
            const double value = Cornerness(view, x, y);
            if (value > best) best = value, corner.x = x, corner.y = y;
          }
        }
        if (corner.x < 0) continue;
        corner.order = HashOf(seed, v, uint64_t(corner.y) << 32 | uint64_t(corner.x));
        of_view[v].push_back(corner);
      }
    }
  });
  std::vector<Corner> corners;
  for (const auto& found : of_view) corners.insert(corners.end(), found.begin(), found.end());
  std::sort(corners.begin(), corners.end(),
            [](const Corner& a, const Corner& b) { return a.order < b.order; });
  return corners;
}

struct Sighting {
  size_t view;
  Vec2 xy;
};

// Gauss-Newton on the reprojection error from the true point: the result of bundle adjustment with
// known cameras.
Vec3 Triangulate(const std::vector<TracedView>& views, const std::vector<Sighting>& sightings,
                 Vec3 point) {
  for (int round = 0; round < 4; ++round) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Vec3 right = Vec3::Zero();
    for (const Sighting& sighting : sightings) {
      const PosedCamera& camera = views[sighting.view].camera;
      const Vec3 p = camera.cam_from_world * point;
      if (p.z() <= 0) return point;
      const double fx = camera.camera.fx() / p.z(), fy = camera.camera.fy() / p.z();
      Eigen::Matrix<double, 2, 3> jacobian;
      jacobian << fx, 0, -fx * p.x() / p.z(), 0, fy, -fy * p.y() / p.z();
      jacobian = jacobian * camera.cam_from_world.rotation.toRotationMatrix();
      const Vec2 residual = sighting.xy - *camera.camera.ImgFromCam(p);
      normal += jacobian.transpose() * jacobian;
      right += jacobian.transpose() * residual;
    }
    point += normal.ldlt().solve(right);
  }
  return point;
}

std::vector<Sighting> Observe(const std::vector<TracedView>& views, int part, const Vec3& point,
                              double noise, Random* random) {
  std::vector<Sighting> sightings;
  for (size_t v = 0; v < views.size(); ++v) {
    const auto seen = Sees(views[v], part, point);
    if (!seen || random->Uniform() > kDetected) continue;
    const double dy = noise * random->Gaussian(), dx = noise * random->Gaussian();
    const Vec2 xy(seen->x() + dx, seen->y() + dy);
    const Camera& camera = views[v].camera.camera;
    if (xy.x() >= 0 && xy.y() >= 0 && xy.x() < camera.width && xy.y() < camera.height) {
      sightings.push_back({v, xy});
    }
  }
  return sightings;
}

// The flaws of the cloud that the options ask for.
Vec3 Displace(const Vec3& point, const Vec3& eye, const SyntheticOptions& options) {
  Vec3 displaced = point;
  if (options.cloud_scale != 1) displaced = eye + options.cloud_scale * (point - eye);
  return displaced + options.cloud_shift * Vec3(1, 0, 1);
}

void AddUnmatched(uint64_t seed, Reconstruction* reconstruction) {
  for (auto& [id, view] : reconstruction->views) {
    Random random(HashOf(seed, id));
    const Camera& camera = reconstruction->cameras.at(view.camera_id);
    const auto count = size_t(kUnmatched * double(view.observations.size()));
    for (size_t i = 0; i < count; ++i) {
      Observation stray;
      stray.xy = {random.Uniform(0, camera.width), random.Uniform(0, camera.height)};
      view.observations.push_back(stray);
    }
  }
}

}  // namespace

void AddSparsePoints(const World& world, const std::vector<TracedView>& views,
                     const SyntheticOptions& options, Reconstruction* reconstruction) {
  std::unordered_set<uint64_t> taken;
  const Vec3 eye = MiddleOfCameras(views);
  for (const Corner& corner : FindCorners(world, views, HashOf(options.seed, 30))) {
    if (int(reconstruction->points.size()) >= options.sparse_points) break;
    const TracedView& view = views[corner.view];
    const int part = view.parts(corner.x, corner.y);
    const Ray ray = PixelRay(view.camera, corner.x + 0.5, corner.y + 0.5);
    Hit hit;
    if (!world.Intersect(ray, 1e-6, 1e3, &hit) || hit.shape != part) continue;
    const Vec3 truth = ray.At(hit.t);
    // One point a small cube, or every view would add its own copy of the same corner.
    const Eigen::Array3i cube =
        (truth.array() / (3 * hit.t / view.camera.camera.fx())).floor().cast<int>();
    if (!taken.insert(HashOf(uint32_t(cube.x()), uint32_t(cube.y()), uint32_t(cube.z()))).second) {
      continue;
    }
    Random random(HashOf(options.seed, 31, corner.order));
    const auto sightings = Observe(views, part, truth, options.point_noise, &random);
    if (sightings.size() < 3) continue;

    SparsePoint point;
    point.id = PointId(reconstruction->points.size() + 1);
    point.xyz = Displace(Triangulate(views, sightings, truth), eye, options);
    for (int c = 0; c < 3; ++c) {
      const float value = view.truth.photo(corner.x, corner.y, c);
      point.color[c] = uint8_t(std::lround(std::clamp(value, 0.0f, 1.0f) * 255));
    }
    point.error = 0;
    for (const Sighting& sighting : sightings) {
      const auto projected = views[sighting.view].camera.Project(point.xyz);
      if (projected) point.error += (projected->head<2>() - sighting.xy).norm();
      View& seen_in = reconstruction->views.at(ViewId(sighting.view + 1));
      point.track.push_back({seen_in.id, uint32_t(seen_in.observations.size())});
      seen_in.observations.push_back({sighting.xy, point.id});
    }
    point.error /= double(sightings.size());
    reconstruction->points[point.id] = std::move(point);
  }
  AddUnmatched(HashOf(options.seed, 32), reconstruction);
}

}  // namespace retint::synthetic
