// SPDX-License-Identifier: BSD-3-Clause
#include "synthetic/light.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/parallel.h"
#include "synthetic/noise.h"

namespace retint::synthetic {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kOffset = 2e-4;  // meters off the surface at which secondary rays start
constexpr double kFar = 1e3;
constexpr int kLightGrid = 7;                         // squared: shadow rays a lumel
constexpr int kGatherRings = 8, kGatherSectors = 16;  // rays of the bounce
// Light that has bounced more than once, as a share of the room's mean irradiance.
constexpr double kAmbient = 0.35;

double Wrap(double x, double n) { return x - n * std::floor(x / n); }

}  // namespace

Vec3 Lighting::Chart::Sample(const Vec2& uv) const {
  const double x = uv.x() * nu - 0.5, y = std::clamp(uv.y() * nv - 0.5, 0.0, nv - 1.0);
  const double fx = std::floor(x);
  int x0 = int(fx), x1 = x0 + 1;
  if (wrap) {
    x0 = (x0 % nu + nu) % nu;
    x1 = (x1 % nu + nu) % nu;
  } else {
    x0 = std::clamp(x0, 0, nu - 1);
    x1 = std::clamp(x1, 0, nu - 1);
  }
  const int y0 = std::min(int(y), nv - 1), y1 = std::min(y0 + 1, nv - 1);
  const double u = x - fx, v = y - y0;
  const auto at = [&](int i, int j) { return Vec3(irradiance[size_t(j * nu + i)].cast<double>()); };
  return (1 - v) * ((1 - u) * at(x0, y0) + u * at(x1, y0)) +
         v * ((1 - u) * at(x0, y1) + u * at(x1, y1));
}

Vec3 Lighting::Reflection::Sample(const Vec3& direction) const {
  const double phi = std::atan2(direction.z(), direction.x()) / (2 * kPi);
  const double theta = std::acos(std::clamp(direction.y(), -1.0, 1.0)) / kPi;
  const double x = Wrap(phi, 1) * nu - 0.5, y = std::clamp(theta * nv - 0.5, 0.0, nv - 1.0);
  const int x0 = int(Wrap(std::floor(x), nu)), x1 = (x0 + 1) % nu;
  const int y0 = std::min(int(y), nv - 1), y1 = std::min(y0 + 1, nv - 1);
  const double u = x - std::floor(x), v = y - y0;
  const auto at = [&](int i, int j) -> const Vec3& { return radiance[size_t(j * nu + i)]; };
  return (1 - v) * ((1 - u) * at(x0, y0) + u * at(x1, y0)) +
         v * ((1 - u) * at(x0, y1) + u * at(x1, y1));
}

Lighting::Lighting(const World& world, double coarseness, Monitor& monitor) : world_(world) {
  charts_ = MakeCharts(0.006 * coarseness, 0.025 * coarseness);
  Bake(&charts_, 1, 0, 0.5, monitor,
       [&](const Surfel& at, uint64_t seed) { return DirectIrradiance(at, seed); });
  Charts bounced = MakeCharts(0.014 * coarseness, 0.06 * coarseness);
  Bake(&bounced, 2, 0.5, 0.9, monitor,
       [&](const Surfel& at, uint64_t seed) { return GatheredIrradiance(at, seed); });
  for (size_t part = 0; part < charts_.size(); ++part) {
    for (size_t c = 0; c < charts_[part].size(); ++c) {
      Chart& chart = charts_[part][c];
      for (int j = 0; j < chart.nv; ++j) {
        for (int i = 0; i < chart.nu; ++i) {
          chart.irradiance[size_t(j * chart.nu + i)] +=
              bounced[part][c].Sample({(i + 0.5) / chart.nu, (j + 0.5) / chart.nv}).cast<float>();
        }
      }
    }
  }
  reflections_.resize(world_.materials.size());
  ParallelTasks(int64_t(world_.materials.size()), [&](size_t i) {
    if (world_.materials[i].specular > 0) reflections_[i] = MakeReflection(int(i));
  });
  monitor.Step("light", 1, 1);
}

Lighting::Charts Lighting::MakeCharts(double lumel_low, double lumel_high) const {
  Charts charts;
  for (const Part& part : world_.parts) {
    const auto sizes = part.shape->ChartSizes();
    double largest = 0;
    for (const Vec2& size : sizes) largest = std::max(largest, size.maxCoeff());
    const double lumel = std::clamp(largest / 320 * (lumel_low / 0.006), lumel_low, lumel_high);
    charts.emplace_back();
    for (const Vec2& size : sizes) {
      Chart chart;
      chart.nu = std::max(part.shape->WrapsU() ? 6 : 2, int(std::ceil(size.x() / lumel)));
      chart.nv = std::max(2, int(std::ceil(size.y() / lumel)));
      chart.wrap = part.shape->WrapsU();
      charts.back().push_back(chart);
    }
  }
  return charts;
}

template <typename Function>
void Lighting::Bake(Charts* charts, int blurs, double progress0, double progress1, Monitor& monitor,
                    const Function& irradiance_at) const {
  for (size_t part = 0; part < charts->size(); ++part) {
    monitor.Step("light",
                 progress0 + (progress1 - progress0) * double(part) / double(charts->size()), 1);
    auto& of_part = (*charts)[part];
    for (size_t c = 0; c < of_part.size(); ++c) {
      Chart& chart = of_part[c];
      chart.irradiance.assign(size_t(chart.nu) * size_t(chart.nv), Eigen::Vector3f::Zero());
      chart.valid.assign(chart.irradiance.size(), 0);
      ParallelTasks(int64_t(chart.nv), [&](int j) {
        for (int i = 0; i < chart.nu; ++i) {
          const size_t index = size_t(j * chart.nu + i);
          const Surfel at =
              world_.parts[part].shape->At(int(c), {(i + 0.5) / chart.nu, (j + 0.5) / chart.nv});
          if (world_.Buried(at.point + 5 * kOffset * at.normal, int(part))) continue;
          chart.valid[index] = 1;
          chart.irradiance[index] =
              irradiance_at(at, HashOf(part, c, index)).template cast<float>();
        }
      });
      Spread(&chart);
      for (int k = 0; k < blurs; ++k) Blur(&chart);
    }
    LightBuried(&of_part);
  }
}

// Gives buried samples their neighbors' mean, so that interpolation beside another object's foot
// does not pick up the darkness under it.
void Lighting::Spread(Chart* chart) {
  std::vector<unsigned char> known = chart->valid;
  for (int round = 0; round < 64; ++round) {
    std::vector<unsigned char> next = known;
    bool changed = false;
    for (int j = 0; j < chart->nv; ++j) {
      for (int i = 0; i < chart->nu; ++i) {
        if (known[size_t(j * chart->nu + i)]) continue;
        Eigen::Vector3f sum = Eigen::Vector3f::Zero();
        int count = 0;
        for (int dj = -1; dj <= 1; ++dj) {
          for (int di = -1; di <= 1; ++di) {
            int x = i + di;
            const int y = j + dj;
            if (chart->wrap) x = (x + chart->nu) % chart->nu;
            if (x < 0 || y < 0 || x >= chart->nu || y >= chart->nv) continue;
            const size_t k = size_t(y * chart->nu + x);
            if (!known[k]) continue;
            sum += chart->irradiance[k];
            ++count;
          }
        }
        if (count == 0) continue;
        chart->irradiance[size_t(j * chart->nu + i)] = sum / float(count);
        next[size_t(j * chart->nu + i)] = 1;
        changed = true;
      }
    }
    known = std::move(next);
    if (!changed) break;
  }
}

// A chart that is buried altogether may still show a sliver between its samples: give it the part's
// mean light.
void Lighting::LightBuried(std::vector<Chart>* charts) {
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  size_t count = 0;
  for (const Chart& chart : *charts) {
    for (size_t i = 0; i < chart.irradiance.size(); ++i) {
      if (!chart.valid[i]) continue;
      sum += chart.irradiance[i];
      ++count;
    }
  }
  if (count == 0) return;
  for (Chart& chart : *charts) {
    if (std::find(chart.valid.begin(), chart.valid.end(), 1) != chart.valid.end()) continue;
    std::fill(chart.irradiance.begin(), chart.irradiance.end(), sum / float(count));
  }
}

// Binomial 3x3.
void Lighting::Blur(Chart* chart) {
  const auto pass = [&](int dx, int dy) {
    const std::vector<Eigen::Vector3f> source = chart->irradiance;
    const auto at = [&](int x, int y) -> const Eigen::Vector3f& {
      x = chart->wrap ? (x + chart->nu) % chart->nu : std::clamp(x, 0, chart->nu - 1);
      return source[size_t(std::clamp(y, 0, chart->nv - 1) * chart->nu + x)];
    };
    for (int j = 0; j < chart->nv; ++j) {
      for (int i = 0; i < chart->nu; ++i) {
        chart->irradiance[size_t(j * chart->nu + i)] =
            0.25f * at(i - dx, j - dy) + 0.5f * at(i, j) + 0.25f * at(i + dx, j + dy);
      }
    }
  };
  pass(1, 0);
  pass(0, 1);
}

Vec3 Lighting::DirectIrradiance(const Surfel& at, uint64_t seed) const {
  const AreaLight& light = world_.light;
  const Vec3 origin = at.point + kOffset * at.normal, light_normal = light.Normal();
  Random random(seed);
  double sum = 0;
  for (int j = 0; j < kLightGrid; ++j) {
    for (int i = 0; i < kLightGrid; ++i) {
      const double a = 2 * (i + random.Uniform()) / kLightGrid - 1;
      const double b = 2 * (j + random.Uniform()) / kLightGrid - 1;
      const Vec3 to_light = light.center + a * light.half_u + b * light.half_v - origin;
      const double distance2 = to_light.squaredNorm(), distance = std::sqrt(distance2);
      const double cosine = at.normal.dot(to_light) / distance;
      const double cosine_light = -light_normal.dot(to_light) / distance;
      if (cosine <= 0 || cosine_light <= 0) continue;
      if (world_.Occluded({origin, to_light}, 1e-6, 1 - 1e-6)) continue;
      sum += cosine * cosine_light / distance2;
    }
  }
  return light.radiance * (sum * light.Area() / (kLightGrid * kLightGrid));
}

Vec3 Lighting::GatheredIrradiance(const Surfel& at, uint64_t seed) const {
  const Vec3 origin = at.point + kOffset * at.normal;
  const Vec3 tangent = at.normal.unitOrthogonal(), bitangent = at.normal.cross(tangent);
  Random random(seed);
  Vec3 sum = Vec3::Zero();
  for (int ring = 0; ring < kGatherRings; ++ring) {
    for (int sector = 0; sector < kGatherSectors; ++sector) {
      // Cosine-weighted, stratified.
      const double r2 = (ring + random.Uniform()) / kGatherRings, r = std::sqrt(r2);
      const double phi = 2 * kPi * (sector + random.Uniform()) / kGatherSectors;
      const Vec3 direction = r * std::cos(phi) * tangent + r * std::sin(phi) * bitangent +
                             std::sqrt(1 - r2) * at.normal;
      Hit hit;
      const Ray ray = {origin, direction};
      if (!world_.Intersect(ray, 1e-6, kFar, &hit)) {
        sum += world_.Environment(direction);
        continue;
      }
      const Vec3 point = origin + hit.t * direction;
      const Vec3 irradiance =
          charts_[size_t(hit.shape)][size_t(hit.chart)].Sample(hit.uv) + Vec3::Constant(kAmbient);
      sum += world_.Albedo(hit, point).cwiseProduct(irradiance) / kPi;
    }
  }
  return sum * (kPi / (kGatherRings * kGatherSectors));
}

Lighting::Reflection Lighting::MakeReflection(int material) const {
  const double sharpness = world_.materials[size_t(material)].sharpness;
  Eigen::AlignedBox3d bounds;
  int object = 0;
  for (const Part& part : world_.parts) {
    if (part.material != material) continue;
    bounds.extend(part.bounds);
    object = part.object;
  }
  Reflection map;
  map.nu = sharpness > 60 ? 96 : 48;
  map.nv = map.nu / 2;
  std::vector<Vec3> directions, incoming;
  std::vector<double> weights;
  for (int j = 0; j < map.nv; ++j) {
    const double theta = kPi * (j + 0.5) / map.nv;
    for (int i = 0; i < map.nu; ++i) {
      const double phi = 2 * kPi * (i + 0.5) / map.nu;
      const Vec3 d(std::sin(theta) * std::cos(phi), std::cos(theta),
                   std::sin(theta) * std::sin(phi));
      // What surrounds the object, seen from its middle and through itself.
      Ray ray = {bounds.center(), d};
      Hit hit;
      Vec3 radiance = Vec3::Zero();
      double t = 0;
      for (;;) {
        if (!world_.Intersect(ray, t + 1e-6, kFar, &hit)) {
          radiance = world_.Sky(ray);
          break;
        }
        if (world_.parts[size_t(hit.shape)].object != object) {
          radiance = Diffuse(hit, ray.origin + hit.t * d);
          break;
        }
        t = hit.t;
      }
      directions.push_back(d);
      incoming.push_back(radiance);
      weights.push_back(std::sin(theta));
    }
  }
  const double nearest_cosine = std::pow(1e-3, 1 / sharpness);
  for (const Vec3& d : directions) {
    Vec3 sum = Vec3::Zero();
    double total = 0;
    for (size_t k = 0; k < directions.size(); ++k) {
      const double cosine = d.dot(directions[k]);
      if (cosine < nearest_cosine) continue;
      const double weight = weights[k] * std::pow(cosine, sharpness);
      sum += weight * incoming[k];
      total += weight;
    }
    map.radiance.push_back(sum / total);
  }
  return map;
}

Vec3 Lighting::Diffuse(const Hit& hit, const Vec3& point) const {
  const Material& material = world_.MaterialOf(hit.shape);
  if (material.metal) return Vec3::Zero();
  const auto& charts = charts_[size_t(hit.shape)];
  Vec3 irradiance = charts[size_t(hit.chart)].Sample(hit.uv);
  if (material.translucency > 0) {
    irradiance = (1 - material.translucency) * irradiance +
                 material.translucency * charts[size_t(1 - hit.chart)].Sample(hit.uv);
  }
  return world_.Albedo(hit, point).cwiseProduct(irradiance) / kPi;
}

Vec3 Lighting::Radiance(const Hit& hit, const Vec3& point, const Vec3& direction) const {
  const Material& material = world_.MaterialOf(hit.shape);
  if (material.specular <= 0) return Diffuse(hit, point);
  const Vec3 d = direction.normalized();
  const double cosine = std::max(0.0, -d.dot(hit.normal));
  const Vec3 mirror = d + 2 * cosine * hit.normal;
  const Reflection& reflection = reflections_[size_t(world_.parts[size_t(hit.shape)].material)];
  const Vec3 reflected = reflection.Sample(mirror.normalized());
  if (material.metal) {
    // Crevices and undersides are darker than the free-standing reflection says.
    const Vec3 ambient = charts_[size_t(hit.shape)][size_t(hit.chart)].Sample(hit.uv) / kPi;
    return world_.Albedo(hit, point).cwiseProduct(0.75 * reflected + 0.25 * ambient);
  }
  // Schlick's approximation, held back at grazing angles as rough surfaces do.
  const double rim = (1 - material.specular) * std::min(1.0, material.sharpness / 120);
  const double fresnel = material.specular + rim * std::pow(1 - cosine, 5);
  return (1 - fresnel) * Diffuse(hit, point) + fresnel * reflected;
}

Vec3 Lighting::Color(const Ray& ray, int likely) const {
  Hit hit;
  if (likely >= 0 && world_.parts[size_t(likely)].shape->Intersect(ray, 1e-6, kFar, &hit)) {
    hit.shape = likely;
  } else if (!world_.Intersect(ray, 1e-6, kFar, &hit)) {
    return Vec3::Zero();
  }
  return EncodeHere(Radiance(hit, ray.origin + hit.t * ray.direction, ray.direction));
}

}  // namespace retint::synthetic
