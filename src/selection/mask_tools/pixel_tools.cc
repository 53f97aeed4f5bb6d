// SPDX-License-Identifier: BSD-3-Clause
#include "selection/mask_tools/pixel_tools.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/parallel.h"
#include "kernels/common/color_spaces.h"
#include "selection/depth_sampling.h"

namespace retint {
namespace {

using Features4 = PixelArray<float, 4>;

Eigen::Vector3f LabAt(const Features4& features, int x, int y) {
  return Eigen::Map<const Eigen::Vector3f>(&features(x, y));
}

void RequirePixel(const ViewLayers& layers, int x, int y) {
  CheckOption(layers.color.Contains(x, y),
              "pixel " + std::to_string(x) + "," + std::to_string(y) + " lies outside the view");
}

template <typename Inside>
Mask OfPixels(const ViewLayers& layers, const Inside& inside) {
  CheckLayers(layers);
  Mask mask(layers.color.width, layers.color.height);
  ParallelRanges(mask.height, 16, [&](int64_t begin, int64_t end) {
    for (int y = int(begin); y < int(end); ++y) {
      for (int x = 0; x < mask.width; ++x) mask(x, y) = inside(x, y) ? 255 : 0;
    }
  });
  return mask;
}

template <typename Inside>
Mask OfSurface(const ViewLayers& layers, const Inside& inside) {
  CheckOption(!layers.Surface().Empty(), "a sphere and a box need the view's depth");
  return OfPixels(layers, [&](int x, int y) {
    if (!HasDepth(layers.Surface(), x, y)) return false;
    return inside(SurfacePoint(layers, x, y));
  });
}

}  // namespace

std::array<float, 3> ColorAt(const ViewLayers& layers, int x, int y) {
  CheckLayers(layers);
  RequirePixel(layers, x, y);
  std::array<float, 3> mean = {0, 0, 0};
  int count = 0;
  for (int j = std::max(0, y - 1); j <= std::min(layers.color.height - 1, y + 1); ++j) {
    for (int i = std::max(0, x - 1); i <= std::min(layers.color.width - 1, x + 1); ++i, ++count) {
      for (int c = 0; c < 3; ++c) mean[size_t(c)] += layers.color(i, j, c);
    }
  }
  for (float& value : mean) value = std::clamp(value / float(count), 0.0f, 1.0f);
  return mean;
}

Mask MagicWand(const ViewLayers& layers, const WandOptions& options) {
  CheckOption(options.color >= 0 && options.depth >= 0 && options.normal >= 0,
              "a tolerance of the wand must not be below 0");
  const std::array<float, 3> rgb = ColorAt(layers, options.x, options.y);
  const Mask alike = LikeColor(layers, rgb, options.color);
  const DepthMap& depth = layers.Surface();
  const bool has_depth = !depth.Empty();
  const double least_cosine = std::cos(std::min(options.normal, 180.0) * std::numbers::pi / 180);
  std::vector<Eigen::Vector3f> normals(has_depth ? depth.NumPixels() : 0);
  ParallelRanges(has_depth ? depth.height : 0, 8, [&](int64_t begin, int64_t end) {
    for (int y = int(begin); y < int(end); ++y) {
      for (int x = 0; x < depth.width; ++x) {
        const bool is_held = x == options.x && y == options.y;
        if (!(alike(x, y) || is_held) || !HasDepth(depth, x, y)) continue;
        normals[depth.Index(x, y)] = SurfaceNormal(layers, x, y).cast<float>();
      }
    }
  });
  const auto is_one_surface = [&](int x, int y, int i, int j) {
    if (!has_depth || !HasDepth(depth, x, y) || !HasDepth(depth, i, j)) return true;
    const double a = depth(x, y), b = depth(i, j);
    return std::abs(a - b) <= options.depth * std::min(a, b);
  };
  const bool has_normal = has_depth && HasDepth(depth, options.x, options.y);
  const Eigen::Vector3f held =
      has_normal ? normals[depth.Index(options.x, options.y)] : Eigen::Vector3f::Zero().eval();
  const auto faces_alike = [&](int x, int y) {
    if (!has_normal || !HasDepth(depth, x, y)) return true;
    return double(normals[depth.Index(x, y)].dot(held)) >= least_cosine;
  };
  Mask mask(layers.color.width, layers.color.height);
  mask(options.x, options.y) = 255;
  std::vector<std::pair<int, int>> open = {{options.x, options.y}};
  while (!open.empty()) {
    const auto [x, y] = open.back();
    open.pop_back();
    constexpr int kSteps[4][2] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}};
    for (const auto& step : kSteps) {
      const int i = x + step[0], j = y + step[1];
      if (!mask.Contains(i, j) || mask(i, j) || !alike(i, j)) continue;
      if (!is_one_surface(x, y, i, j) || !faces_alike(i, j)) continue;
      mask(i, j) = 255;
      open.emplace_back(i, j);
    }
  }
  return mask;
}

Mask LikeColor(const ViewLayers& layers, const std::array<float, 3>& rgb, double tolerance) {
  CheckOption(tolerance >= 0, "the tolerance of a color must not be below 0");
  const OkLab lab = OkLabFromSrgb(rgb.data());
  const Eigen::Vector3f wanted(lab.lightness, lab.a, lab.b);
  ViewLayers color_only;
  color_only.color = layers.color;
  const Features4 features = Features(color_only);
  return OfPixels(layers, [&](int x, int y) {
    return double((LabAt(features, x, y) - wanted).norm()) <= tolerance;
  });
}

Mask InSphere(const ViewLayers& layers, const Eigen::Vector3d& center, double radius) {
  CheckOption(radius > 0, "the radius of a sphere must be above 0");
  return OfSurface(layers, [&](const Eigen::Vector3d& point) {
    return (point - center).squaredNorm() <= radius * radius;
  });
}

Mask InBox(const ViewLayers& layers, const Eigen::Vector3d& min, const Eigen::Vector3d& max) {
  CheckOption((min.array() < max.array()).all(), "a box needs its lower corner first");
  return OfSurface(layers, [&](const Eigen::Vector3d& point) {
    return (point.array() >= min.array()).all() && (point.array() <= max.array()).all();
  });
}

Mask Intersection(const Mask& a, const Mask& b) {
  CheckOption(a.width == b.width && a.height == b.height, "masks that are combined need one size");
  Mask both = a;
  for (size_t i = 0; i < both.data.size(); ++i) both.data[i] = std::min(both.data[i], b.data[i]);
  return both;
}

}  // namespace retint
