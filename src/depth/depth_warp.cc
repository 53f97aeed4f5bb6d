// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "depth/colmap_depth.h"
#include "scene/camera_projection.h"

namespace retint {
namespace {

bool IsEdge(float a, float b, double tolerance) {
  return std::abs(a - b) > tolerance * double(std::min(a, b));
}

// A vertex in the target: pixel and inverse depth, which is linear in the image on a plane.
struct Vertex {
  double x, y, inverse;
  float source_depth;  // 0: none
};

double Cross(const Vertex& a, const Vertex& b, double x, double y) {
  return (b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x);
}

void Rasterize(const Vertex& a, const Vertex& b, const Vertex& c, ScalarImage& inverse) {
  const double area = Cross(a, b, c.x, c.y);
  if (!(area > 0)) return;  // seen from behind, or degenerate
  const int x0 = std::max(0, int(std::ceil(std::min({a.x, b.x, c.x}) - 0.5)));
  const int x1 = std::min(inverse.width - 1, int(std::floor(std::max({a.x, b.x, c.x}) - 0.5)));
  const int y0 = std::max(0, int(std::ceil(std::min({a.y, b.y, c.y}) - 0.5)));
  const int y1 = std::min(inverse.height - 1, int(std::floor(std::max({a.y, b.y, c.y}) - 0.5)));
  for (int y = y0; y <= y1; ++y) {
    for (int x = x0; x <= x1; ++x) {
      const double px = x + 0.5, py = y + 0.5;
      const double u = Cross(b, c, px, py), v = Cross(c, a, px, py), w = Cross(a, b, px, py);
      if (u < 0 || v < 0 || w < 0) continue;
      const float value = float((u * a.inverse + v * b.inverse + w * c.inverse) / area);
      float& nearest = inverse(x, y);
      nearest = std::max(nearest, value);
    }
  }
}

}  // namespace

DepthMap ResampleDepth(const DepthMap& map, const Camera& source, const Camera& target,
                       double edge_tolerance) {
  const Camera own = Resized(source, map.width, map.height);
  DepthMap out(target.width, target.height, 0.0f);
  for (int y = 0; y < out.height; ++y) {
    const double v = (y + 0.5 - target.cy()) / target.fy() * own.fy() + own.cy() - 0.5;
    for (int x = 0; x < out.width; ++x) {
      const double u = (x + 0.5 - target.cx()) / target.fx() * own.fx() + own.cx() - 0.5;
      const int near_x = int(std::floor(u + 0.5)), near_y = int(std::floor(v + 0.5));
      if (!map.Contains(near_x, near_y)) continue;
      const float nearest = map(near_x, near_y);
      if (!(nearest > 0)) continue;
      const int left = int(std::floor(u)), top = int(std::floor(v));
      const double wx = u - left, wy = v - top;
      double sum = 0, weight = 0;
      for (int corner = 0; corner < 4; ++corner) {
        const int cx = left + corner % 2, cy = top + corner / 2;
        const double w = (corner % 2 ? wx : 1 - wx) * (corner / 2 ? wy : 1 - wy);
        if (w <= 0 || !map.Contains(cx, cy)) continue;
        const float depth = map(cx, cy);
        if (!(depth > 0) || IsEdge(depth, nearest, edge_tolerance)) continue;
        sum += w / depth;
        weight += w;
      }
      out(x, y) = float(weight / sum);  // the nearest pixel itself always counts
    }
  }
  return out;
}

DepthMap WarpDepth(const DepthMap& map, const PosedCamera& source, const PosedCamera& target,
                   double edge_tolerance) {
  const Camera own = Resized(source.camera, map.width, map.height);
  const Rigid3d target_from_source = target.cam_from_world * source.cam_from_world.Inverse();
  const Eigen::Matrix3d rotation = target_from_source.rotation.toRotationMatrix();
  const auto project = [&](int x, int y) -> Vertex {
    const double z = map(x, y);
    if (!(z > 0)) return {0, 0, 0, 0};
    const Eigen::Vector3d in_source((x + 0.5 - own.cx()) / own.fx() * z,
                                    (y + 0.5 - own.cy()) / own.fy() * z, z);
    const Eigen::Vector3d point = rotation * in_source + target_from_source.translation;
    if (!(point.z() > 1e-6 * z)) return {0, 0, 0, 0};
    return {target.camera.fx() * point.x() / point.z() + target.camera.cx(),
            target.camera.fy() * point.y() / point.z() + target.camera.cy(), 1 / point.z(),
            map(x, y)};
  };

  ScalarImage inverse(target.camera.width, target.camera.height, 0.0f);
  const auto triangle = [&](const Vertex& a, const Vertex& b, const Vertex& c) {
    if (a.source_depth == 0 || b.source_depth == 0 || c.source_depth == 0) return;
    if (IsEdge(a.source_depth, b.source_depth, edge_tolerance) ||
        IsEdge(b.source_depth, c.source_depth, edge_tolerance) ||
        IsEdge(c.source_depth, a.source_depth, edge_tolerance)) {
      return;
    }
    Rasterize(a, b, c, inverse);
  };
  std::vector<Vertex> above(static_cast<size_t>(map.width)), row(static_cast<size_t>(map.width));
  for (int y = 0; y < map.height; ++y) {
    for (int x = 0; x < map.width; ++x) row[size_t(x)] = project(x, y);
    if (y > 0) {
      for (size_t x = 1; x < row.size(); ++x) {
        triangle(above[x - 1], above[x], row[x - 1]);
        triangle(row[x], row[x - 1], above[x]);
      }
    }
    std::swap(above, row);
  }
  DepthMap out(inverse.width, inverse.height, 0.0f);
  for (size_t i = 0; i < out.data.size(); ++i) {
    if (inverse.data[i] > 0) out.data[i] = 1 / inverse.data[i];
  }
  return out;
}

}  // namespace retint
