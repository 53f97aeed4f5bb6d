// SPDX-License-Identifier: BSD-3-Clause
// Light of a synthetic world, baked once: soft shadows of the area light, light from outside and
// one bounce between surfaces on every part's charts; blurred reflections per glossy material.
// Radiance is then a pure function of surface point and direction. Internal to the synthetic
// scenes.
#pragma once

#include <vector>

#include "base/monitor.h"
#include "synthetic/world.h"

namespace retint::synthetic {

class Lighting {
 public:
  // `coarseness` >= 1 multiplies the spacing of the baked samples. `world` must outlive this.
  Lighting(const World& world, double coarseness, Monitor& monitor);

  // Linear radiance that leaves the hit towards -direction (direction: into the surface).
  Vec3 Radiance(const Hit& hit, const Vec3& point, const Vec3& direction) const;
  // The part of it that does not depend on the direction.
  Vec3 Diffuse(const Hit& hit, const Vec3& point) const;
  // Encoded color along a ray, black where it meets nothing. `likely`: a part known to be the
  // first in the way if it is met at all, or -1.
  Vec3 Color(const Ray& ray, int likely) const;
  Vec3 EncodeHere(const Vec3& radiance) const { return Encode(radiance, world_.exposure); }

 private:
  struct Chart {
    int nu = 0, nv = 0;
    bool wrap = false;
    std::vector<Eigen::Vector3f> irradiance;  // [nv, nu]
    std::vector<unsigned char> valid;         // not buried in another part
    Vec3 Sample(const Vec2& uv) const;
  };
  struct Reflection {  // radiance by direction, longitude about y times latitude from +y
    int nu = 0, nv = 0;
    std::vector<Vec3> radiance;
    Vec3 Sample(const Vec3& direction) const;
  };
  using Charts = std::vector<std::vector<Chart>>;  // [part][chart]

  Charts MakeCharts(double lumel_low, double lumel_high) const;
  template <typename Function>
  void Bake(Charts* charts, int blurs, double progress0, double progress1, Monitor& monitor,
            const Function& irradiance_at) const;
  Vec3 DirectIrradiance(const Surfel& at, uint64_t seed) const;
  Vec3 GatheredIrradiance(const Surfel& at, uint64_t seed) const;
  Reflection MakeReflection(int material) const;
  static void Spread(Chart* chart);
  static void Blur(Chart* chart);
  static void LightBuried(std::vector<Chart>* charts);

  const World& world_;
  Charts charts_;
  std::vector<Reflection> reflections_;  // by material; empty for matt ones
};

}  // namespace retint::synthetic
