// SPDX-License-Identifier: BSD-3-Clause
#include "out_of_core/frustum.h"

#include <algorithm>
#include <cmath>

namespace retint {
namespace {

// sqrt(2 ln 255) = 3.33 standard deviations carry alpha down to kMinAlpha; the rest is for needles,
// whose conic rounds.
constexpr double kReach = 4;
// Of a coordinate in the camera, from those in the world: a few units in the last place of each
// term.
constexpr double kRounding = 4e-6;

}  // namespace

Frustum::Frustum(const CameraParams& camera) {
  const float* r = camera.rotation;
  const auto tiles = [](int32_t pixels) {
    return double((pixels + kTileSize - 1) / kTileSize * kTileSize);
  };
  const double blur = kReach * std::sqrt(double(kCovarianceDilation)) + 1;
  // scale * axis . x_in_cam + depth * Z <= reach * sigma
  const auto make = [&](int axis, double scale, double depth, double reach) {
    Plane plane;
    double translation = 0;
    for (size_t i = 0; i < 3; ++i) {
      plane.normal[i] = scale * double(r[3 * size_t(axis) + i]) + depth * double(r[6 + i]);
      translation += std::abs(double(camera.translation[i]));
    }
    plane.offset = scale * double(camera.translation[axis]) + depth * double(camera.translation[2]);
    plane.reach = reach;
    plane.slack = kRounding * (std::abs(scale) + std::abs(depth));
    plane.constant_slack = plane.slack * translation;
    return plane;
  };
  const auto sides = [&](int axis, double focal, double middle, int32_t pixels, size_t at) {
    const double beside = std::abs(middle - pixels / 2.0);  // of the principal point
    const double limit = (double(kFovMargin) * pixels / 2 + beside) / focal;  // ClampedSlope()
    const double reach = kReach * focal * std::sqrt(1 + limit * limit);
    planes_[at] = make(axis, focal, -(tiles(pixels) - middle + blur), reach);
    planes_[at + 1] = make(axis, -focal, -(middle + blur), reach);
  };
  sides(0, double(camera.fx), double(camera.cx), camera.width, 0);
  sides(1, double(camera.fy), double(camera.cy), camera.height, 2);
  planes_[4] = make(2, 0, -1, 0);
  planes_[4].offset += double(kNearPlane);
}

bool Frustum::MaySee(const GaussianBounds& bounds) const {
  double extent = 0;  // of the coordinates
  for (size_t i = 0; i < 3; ++i) {
    extent += std::max(std::abs(double(bounds.low[i])), std::abs(double(bounds.high[i])));
  }
  for (const Plane& plane : planes_) {
    double least = plane.offset;  // over the box
    for (size_t i = 0; i < 3; ++i) {
      const double n = plane.normal[i];
      least += n * double(n > 0 ? bounds.low[i] : bounds.high[i]);
    }
    const double rounding = plane.slack * extent + plane.constant_slack;
    if (least > plane.reach * double(bounds.sigma) + rounding) return false;
  }
  return true;
}

}  // namespace retint
