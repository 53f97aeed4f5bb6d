// SPDX-License-Identifier: BSD-3-Clause
#include "selection/mask_tools/view_layers.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/median.h"
#include "base/parallel.h"
#include "kernels/common/color_spaces.h"
#include "selection/depth_sampling.h"

namespace retint {
namespace {

constexpr float kDepthRange = 1.5f;

Eigen::Vector3d PointInCam(const ViewLayers& layers, int x, int y) {
  const Eigen::Vector3f ray(&layers.rays(x, y));
  return double(layers.Surface()(x, y)) * ray.cast<double>();
}

// From the point of one neighbor along (dx, dy) to that of the opposite one. Each is as far away as
// the surface is smooth, at most 3 pixels: depths from the nearest pixel have steps.
Eigen::Vector3d Tangent(const ViewLayers& layers, int x, int y, int dx, int dy) {
  constexpr int kReach = 3;
  constexpr float kEdge = 0.03F;  // of the depth, a pixel
  const DepthMap& depth = layers.Surface();
  Eigen::Vector3d ends[2];
  for (int side = 0; side < 2; ++side) {
    const int sign = side == 0 ? -1 : 1;
    int i = x, j = y;
    for (int step = 0; step < kReach; ++step) {
      const int next_i = i + sign * dx, next_j = j + sign * dy;
      if (!depth.Contains(next_i, next_j) || !HasDepth(depth, next_i, next_j)) break;
      if (std::abs(depth(next_i, next_j) - depth(i, j)) > kEdge * depth(i, j)) break;
      i = next_i, j = next_j;
    }
    ends[side] = PointInCam(layers, i, j);
  }
  return ends[1] - ends[0];
}

// The median depth of every sixteenth pixel; 1 if none has depth.
float UsualDepth(const DepthMap& depth) {
  std::vector<double> some;
  for (int y = 0; y < depth.height; y += 4) {
    for (int x = 0; x < depth.width; x += 4) {
      if (HasDepth(depth, x, y)) some.push_back(double(depth(x, y)));
    }
  }
  return float(Median(std::move(some), 1));
}

}  // namespace

Eigen::Vector3d SurfacePoint(const ViewLayers& layers, int x, int y) {
  if (layers.rays.Empty()) {
    return layers.camera.Unproject({x + 0.5, y + 0.5}, double(layers.Surface()(x, y)));
  }
  return layers.camera.cam_from_world.Inverse() * PointInCam(layers, x, y);
}

Eigen::Vector3d SurfaceNormal(const ViewLayers& layers, int x, int y) {
  if (layers.rays.Empty()) return NormalFromDepth(layers.camera.camera, layers.Surface(), x, y);
  const Eigen::Vector3d normal =
      Tangent(layers, x, y, 0, 1).cross(Tangent(layers, x, y, 1, 0)).normalized();
  return normal.dot(PointInCam(layers, x, y)) > 0 ? Eigen::Vector3d(-normal) : normal;
}

Eigen::Vector3d RayAt(const ViewLayers& layers, const Eigen::Vector2d& at) {
  if (layers.rays.Empty()) return layers.camera.camera.CamFromImg(at).value().homogeneous();
  const auto ray = [&](int x, int y) -> Eigen::Vector3d {
    x = std::clamp(x, 0, layers.rays.width - 1), y = std::clamp(y, 0, layers.rays.height - 1);
    return Eigen::Vector3f(&layers.rays(x, y)).cast<double>();
  };
  const double x = std::clamp(at.x(), 0.0, double(layers.rays.width)) - 0.5;
  const double y = std::clamp(at.y(), 0.0, double(layers.rays.height)) - 0.5;
  const int left = int(std::floor(x)), top = int(std::floor(y));
  const double fx = x - left, fy = y - top;
  return (1 - fy) * ((1 - fx) * ray(left, top) + fx * ray(left + 1, top)) +
         fy * ((1 - fx) * ray(left, top + 1) + fx * ray(left + 1, top + 1));
}

void CheckLayers(const ViewLayers& layers) {
  CheckOption(layers.color.NumPixels() > 0, "a view without pixels has no outline");
  CheckOption(layers.rays.Empty() || (layers.rays.width == layers.color.width &&
                                      layers.rays.height == layers.color.height),
              "color and rays of a view need one size");
  for (const DepthMap* depth : {&layers.depth, &layers.surface}) {
    CheckOption(depth->Empty() ||
                    (depth->width == layers.color.width && depth->height == layers.color.height),
                "color and depth of a view need one size");
  }
}

double PixelsPerRadian(const ViewLayers& layers) {
  const Camera& camera = layers.camera.camera;
  if (layers.rays.Empty()) {
    const bool known = camera.IsPinhole() && !camera.params.empty();
    return known ? std::sqrt(camera.fx() * camera.fy()) : double(layers.color.width);
  }
  std::vector<double> scales;
  for (int y = 0; y < layers.rays.height; y += 4) {
    for (int x = 4; x < layers.rays.width; x += 4) {
      const Eigen::Map<const Eigen::Vector3f> from(&layers.rays(x - 1, y)), to(&layers.rays(x, y));
      const float sine = from.normalized().cross(to.normalized()).norm();
      if (sine > 0) scales.push_back(1 / double(sine));
    }
  }
  return Median(std::move(scales), double(layers.rays.width));
}

PixelArray<float, 4> Features(const ViewLayers& layers, const GridRect& part) {
  const float middle = std::log(UsualDepth(layers.depth));
  PixelArray<float, 4> features(part.width, part.height);
  const auto has_depth = [&](int x, int y) {
    return !layers.depth.Empty() && HasDepth(layers.depth, part.x + x, part.y + y);
  };
  ParallelRanges(part.height, 16, [&](int64_t begin, int64_t end) {
    for (int y = int(begin); y < int(end); ++y) {
      for (int x = 0; x < part.width; ++x) {
        float rgb[3];
        for (int c = 0; c < 3; ++c)
          rgb[c] = std::clamp(layers.color(part.x + x, part.y + y, c), 0.0f, 1.0f);
        const OkLab lab = OkLabFromSrgb(rgb);
        float* const out = &features(x, y);
        out[0] = lab.lightness, out[1] = lab.a, out[2] = lab.b;
        if (has_depth(x, y)) out[3] = std::log(layers.depth(part.x + x, part.y + y));
      }
    }
  });
  ParallelRanges(part.height, 16, [&](int64_t begin, int64_t end) {
    for (int y = int(begin); y < int(end); ++y) {
      for (int x = 0; x < part.width; ++x) {
        float& depth = features(x, y, 3);
        const float away = has_depth(x, y) ? depth - middle : kDepthRange;
        depth = kFeaturesPerLogDepth * std::clamp(away, -kDepthRange, kDepthRange);
      }
    }
  });
  return features;
}

PixelArray<float, 4> Features(const ViewLayers& layers) {
  return Features(layers, {0, 0, layers.color.width, layers.color.height});
}

}  // namespace retint
