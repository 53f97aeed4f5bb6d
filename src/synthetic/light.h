// SPDX-License-Identifier: BSD-3-Clause
// Light of a synthetic world, baked once: soft shadows of the area light, light from outside and
// one bounce between surfaces on every part's charts; blurred reflections per glossy material.
// Radiance is then a pure function of surface point and direction. Internal to the synthetic
// scenes.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "base/monitor.h"
#include "synthetic/world.h"

namespace retint::synthetic {

// Samples over [0, 1] x [0, 1].
template <typename Value>
struct LightGrid {
  int nu = 0, nv = 0;
  bool wrap = false;          // in u
  std::vector<Value> values;  // [nv, nu]

  // Index of a sample; beyond the border the nearest one.
  size_t Index(int i, int j) const {
    i = wrap ? (i % nu + nu) % nu : std::clamp(i, 0, nu - 1);
    return size_t(std::clamp(j, 0, nv - 1) * nu + i);
  }
  Vec3 Sample(const Vec2& uv) const {  // bilinear
    const double x = uv.x() * nu - 0.5, y = std::clamp(uv.y() * nv - 0.5, 0.0, nv - 1.0);
    const int x0 = int(std::floor(x)), y0 = int(y);
    const double u = x - x0, v = y - y0;
    const auto at = [&](int i, int j) { return Vec3(values[Index(i, j)].template cast<double>()); };
    return (1 - v) * ((1 - u) * at(x0, y0) + u * at(x0 + 1, y0)) +
           v * ((1 - u) * at(x0, y0 + 1) + u * at(x0 + 1, y0 + 1));
  }
};

class Lighting {
 public:
  // `coarseness` >= 1 multiplies the spacing of the baked samples. `world` must outlive this.
  Lighting(const World& world, double coarseness, Monitor& monitor);

  // Linear radiance that leaves the hit towards -direction (direction: into the surface).
  Vec3 Radiance(const Hit& hit, const Vec3& point, const Vec3& direction) const;
  // The same, encoded for a display.
  Vec3 Encoded(const Hit& hit, const Vec3& point, const Vec3& direction) const {
    return Encode(Radiance(hit, point, direction), world_.exposure);
  }
  // Encoded color along a ray, black where it meets nothing. `likely`: a part known to be the
  // first in the way if it is met at all, or -1.
  Vec3 Color(const Ray& ray, int likely) const;

 private:
  using Chart = LightGrid<Eigen::Vector3f>;        // irradiance
  using Charts = std::vector<std::vector<Chart>>;  // [part][chart]
  using Irradiance = std::function<Vec3(const Surfel& at, uint64_t seed)>;

  // Samples are `low` to `high` meters apart.
  Charts Bake(double low, double high, int blurs, double progress0, double progress1,
              const Irradiance& irradiance, Monitor& monitor) const;
  Vec3 Direct(const Surfel& at, uint64_t seed) const;
  Vec3 Gathered(const Surfel& at, uint64_t seed) const;
  // Radiance by direction, longitude about y times latitude from +y.
  LightGrid<Vec3> MakeReflection(int material) const;
  // The part of the radiance that does not depend on the direction.
  Vec3 Diffuse(const Hit& hit, const Vec3& point) const;

  const World& world_;
  Charts charts_;
  std::vector<LightGrid<Vec3>> reflections_;  // by material; empty for matt ones
};

}  // namespace retint::synthetic
