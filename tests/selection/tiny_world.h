// SPDX-License-Identifier: BSD-3-Clause
// A world whose truth is known in closed form: a ball before a slanted wall, seen by cameras on an
// arc. Exact depth, object masks, sparse points on the surfaces with tracks.
#pragma once

#include <cmath>
#include <optional>
#include <random>
#include <string>

#include "scene/image.h"
#include "scene/reconstruction.h"

namespace retint {

struct TinyWorld {
  Eigen::Vector3d ball_center = {0.2, -0.1, 5};
  double ball_radius = 1;
  Eigen::Vector3d wall_normal = Eigen::Vector3d(0.25, 0.1, -1).normalized();
  double wall_offset = -7;  // normal . x
  Reconstruction reconstruction;

  struct Hit {
    double z = 0;
    bool on_ball = false;
    Eigen::Vector3d position, normal;  // world
  };

  // First surface along the ray through a continuous pixel.
  std::optional<Hit> Cast(const PosedCamera& view, const Eigen::Vector2d& pixel) const {
    const Eigen::Vector3d origin = view.Center();
    const Eigen::Vector3d step = view.Unproject(pixel, 1.0) - origin;  // z grows by 1 a step
    const Eigen::Vector3d to_ball = origin - ball_center;
    const double a = step.squaredNorm(), b = step.dot(to_ball);
    const double c = to_ball.squaredNorm() - ball_radius * ball_radius;
    Hit hit;
    if (b * b - a * c > 0) {
      hit.z = (-b - std::sqrt(b * b - a * c)) / a;
      hit.on_ball = hit.z > 0;
    }
    if (!hit.on_ball) hit.z = (wall_offset - wall_normal.dot(origin)) / wall_normal.dot(step);
    if (!(hit.z > 0)) return std::nullopt;
    hit.position = origin + hit.z * step;
    hit.normal = hit.on_ball ? ((hit.position - ball_center) / ball_radius).eval() : wall_normal;
    return hit;
  }

  PosedCamera Posed(int view_idx) const {
    return reconstruction.Posed(reconstruction.views.at(ViewId(view_idx + 1)));
  }
  const View& view(int view_idx) const { return reconstruction.views.at(ViewId(view_idx + 1)); }

  DepthMap Depth(const PosedCamera& view) const {
    DepthMap depth(view.camera.width, view.camera.height);
    for (int y = 0; y < depth.height; ++y) {
      for (int x = 0; x < depth.width; ++x) {
        if (const auto hit = Cast(view, {x + 0.5, y + 0.5})) depth(x, y) = float(hit->z);
      }
    }
    return depth;
  }

  Mask BallMask(const PosedCamera& view) const {
    Mask mask(view.camera.width, view.camera.height);
    for (int y = 0; y < mask.height; ++y) {
      for (int x = 0; x < mask.width; ++x) {
        const auto hit = Cast(view, {x + 0.5, y + 0.5});
        mask(x, y) = hit && hit->on_ball ? 255 : 0;
      }
    }
    return mask;
  }

  // `num_views` cameras of 160 x 120 on an arc around the ball. `num_points` sparse points on
  // visible surfaces, displaced along the normal by Gaussian noise of `noise` (world units).
  static TinyWorld Make(int num_views, int num_points, double noise, uint64_t seed) {
    TinyWorld world;
    world.reconstruction.cameras[1] = Camera::Pinhole(1, 160, 120, 150, 148, 81, 59);
    for (int i = 0; i < num_views; ++i) {
      View view;
      view.id = ViewId(i + 1);
      view.name = "view" + std::to_string(i) + ".png";
      view.camera_id = 1;
      const double angle = num_views > 1 ? 0.5 * (double(i) / (num_views - 1) - 0.5) : 0;
      const Eigen::Quaterniond rotation(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()));
      // Looks at a point five units ahead from five units away.
      const Eigen::Vector3d target(0, 0, 5);
      view.cam_from_world.rotation = rotation;
      view.cam_from_world.translation = Eigen::Vector3d(0, 0, 5) - rotation * target;
      world.reconstruction.views[view.id] = view;
    }
    std::mt19937_64 engine(seed);
    std::uniform_real_distribution<double> uniform(0, 1);
    std::normal_distribution<double> gauss(0, 1);
    for (int i = 0; i < num_points; ++i) {
      const PosedCamera from = world.Posed(i % num_views);
      const auto hit = world.Cast(from, {uniform(engine) * 160, uniform(engine) * 120});
      if (!hit) continue;
      SparsePoint point;
      point.id = PointId(i + 1);
      point.xyz = hit->position + noise * gauss(engine) * hit->normal;
      for (auto& [id, view] : world.reconstruction.views) {
        const PosedCamera posed = world.reconstruction.Posed(view);
        const auto projected = posed.Project(hit->position);
        if (!projected || projected->x() < 0 || projected->y() < 0 || projected->x() >= 160 ||
            projected->y() >= 120) {
          continue;
        }
        const auto first = world.Cast(posed, projected->head<2>());
        if (!first || std::abs(first->z - projected->z()) > 1e-6) continue;
        point.track.push_back({id, uint32_t(view.observations.size())});
        view.observations.push_back({projected->head<2>(), point.id});
      }
      world.reconstruction.points[point.id] = point;
    }
    return world;
  }
};

}  // namespace retint
