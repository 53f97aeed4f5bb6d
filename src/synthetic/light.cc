// SPDX-License-Identifier: BSD-3-Clause
#include "synthetic/light.h"

#include <numbers>
#include <utility>

#include "base/parallel.h"
#include "synthetic/noise.h"

namespace retint::synthetic {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kOffset = 2e-4;  // meters off the surface at which secondary rays start
constexpr double kFar = 1e3;
constexpr int kLightGrid = 7;                         // squared: shadow rays a sample
constexpr int kGatherRings = 8, kGatherSectors = 16;  // rays of the bounce
// Light that has bounced more than once, as a share of the room's mean irradiance.
constexpr double kAmbient = 0.35;

using Chart = LightGrid<Eigen::Vector3f>;
using Flags = std::vector<unsigned char>;

// Gives buried samples, those that are not `known`, their neighbors' mean, so that interpolation
// beside another object's foot does not pick up the darkness under it.
void Spread(Chart* chart, Flags known) {
  bool changed = true;
  for (int round = 0; round < 64 && changed; ++round) {
    changed = false;
    Flags next = known;
    for (int j = 0; j < chart->nv; ++j) {
      for (int i = 0; i < chart->nu; ++i) {
        const size_t index = chart->Index(i, j);
        if (known[index]) continue;
        Eigen::Vector3f sum = Eigen::Vector3f::Zero();
        int count = 0;
        for (int y = std::max(j - 1, 0); y <= std::min(j + 1, chart->nv - 1); ++y) {
          for (int x = i - 1; x <= i + 1; ++x) {
            const size_t k = chart->Index(x, y);
            if (!known[k] || (!chart->wrap && (x < 0 || x >= chart->nu))) continue;
            sum += chart->values[k];
            ++count;
          }
        }
        if (count == 0) continue;
        chart->values[index] = sum / float(count);
        next[index] = 1;
        changed = true;
      }
    }
    known = std::move(next);
  }
}

// Binomial 3x3.
void Blur(Chart* chart) {
  for (const auto& [dx, dy] : {std::pair{1, 0}, {0, 1}}) {
    const Chart source = *chart;
    const auto at = [&](int x, int y) { return source.values[source.Index(x, y)]; };
    for (int j = 0; j < chart->nv; ++j) {
      for (int i = 0; i < chart->nu; ++i) {
        chart->values[chart->Index(i, j)] =
            0.25f * at(i - dx, j - dy) + 0.5f * at(i, j) + 0.25f * at(i + dx, j + dy);
      }
    }
  }
}

// A chart that is buried altogether may still show a sliver between its samples: gives it the mean
// light of the part's other samples.
void LightBuried(std::vector<Chart>* charts, const std::vector<Flags>& known) {
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  size_t count = 0;
  for (size_t c = 0; c < charts->size(); ++c) {
    for (size_t i = 0; i < known[c].size(); ++i) {
      if (!known[c][i]) continue;
      sum += (*charts)[c].values[i];
      ++count;
    }
  }
  for (size_t c = 0; c < charts->size() && count > 0; ++c) {
    if (std::find(known[c].begin(), known[c].end(), 1) != known[c].end()) continue;
    std::fill((*charts)[c].values.begin(), (*charts)[c].values.end(), sum / float(count));
  }
}

}  // namespace

Lighting::Lighting(const World& world, double coarseness, Monitor& monitor) : world_(world) {
  charts_ = Bake(
      0.006 * coarseness, 0.025 * coarseness, 1, 0, 0.5,
      [&](const Surfel& at, uint64_t seed) { return Direct(at, seed); }, monitor);
  const Charts bounced = Bake(
      0.014 * coarseness, 0.06 * coarseness, 2, 0.5, 0.9,
      [&](const Surfel& at, uint64_t seed) { return Gathered(at, seed); }, monitor);
  for (size_t part = 0; part < charts_.size(); ++part) {
    for (size_t c = 0; c < charts_[part].size(); ++c) {
      Chart& chart = charts_[part][c];
      for (int j = 0; j < chart.nv; ++j) {
        for (int i = 0; i < chart.nu; ++i) {
          chart.values[chart.Index(i, j)] +=
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

Lighting::Charts Lighting::Bake(double low, double high, int blurs, double progress0,
                                double progress1, const Irradiance& irradiance,
                                Monitor& monitor) const {
  Charts charts(world_.parts.size());
  for (size_t part = 0; part < charts.size(); ++part) {
    monitor.Step("light",
                 progress0 + (progress1 - progress0) * double(part) / double(charts.size()), 1);
    const Shape& shape = *world_.parts[part].shape;
    double largest = 0;
    for (const Vec2& size : shape.chart_sizes) largest = std::max(largest, size.maxCoeff());
    const double spacing = std::clamp(largest / 320 * (low / 0.006), low, high);
    std::vector<Flags> known;
    for (size_t c = 0; c < shape.chart_sizes.size(); ++c) {
      const Vec2& size = shape.chart_sizes[c];
      Chart chart = {std::max(shape.wraps_u ? 6 : 2, int(std::ceil(size.x() / spacing))),
                     std::max(2, int(std::ceil(size.y() / spacing))),
                     shape.wraps_u,
                     {}};
      chart.values.assign(size_t(chart.nu * chart.nv), Eigen::Vector3f::Zero());
      known.emplace_back(chart.values.size(), 0);
      ParallelTasks(int64_t(chart.nv), [&](int j) {
        for (int i = 0; i < chart.nu; ++i) {
          const size_t index = chart.Index(i, j);
          const Surfel at = shape.At(int(c), {(i + 0.5) / chart.nu, (j + 0.5) / chart.nv});
          if (world_.Buried(at.point + 5 * kOffset * at.normal, int(part))) continue;
          known[c][index] = 1;
          chart.values[index] = irradiance(at, HashOf(part, c, index)).cast<float>();
        }
      });
      Spread(&chart, known[c]);
      for (int k = 0; k < blurs; ++k) Blur(&chart);
      charts[part].push_back(std::move(chart));
    }
    LightBuried(&charts[part], known);
  }
  return charts;
}

Vec3 Lighting::Direct(const Surfel& at, uint64_t seed) const {
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

Vec3 Lighting::Gathered(const Surfel& at, uint64_t seed) const {
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
      if (!world_.Intersect({origin, direction}, 1e-6, kFar, &hit)) {
        sum += world_.Environment(direction);
        continue;
      }
      const Vec3 irradiance =
          charts_[size_t(hit.shape)][size_t(hit.chart)].Sample(hit.uv) + Vec3::Constant(kAmbient);
      sum += world_.Albedo(hit, origin + hit.t * direction).cwiseProduct(irradiance) / kPi;
    }
  }
  return sum * (kPi / (kGatherRings * kGatherSectors));
}

LightGrid<Vec3> Lighting::MakeReflection(int material) const {
  const double sharpness = world_.materials[size_t(material)].sharpness;
  Eigen::AlignedBox3d bounds;
  int object = 0;
  for (const Part& part : world_.parts) {
    if (part.material != material) continue;
    bounds.extend(part.shape->bounds);
    object = part.object;
  }
  LightGrid<Vec3> map;
  map.nu = sharpness > 60 ? 96 : 48;
  map.nv = map.nu / 2;
  map.wrap = true;
  struct Incoming {
    Vec3 direction, radiance;
    double weight;
  };
  std::vector<Incoming> incoming;
  for (int j = 0; j < map.nv; ++j) {
    const double theta = kPi * (j + 0.5) / map.nv;
    for (int i = 0; i < map.nu; ++i) {
      const double phi = 2 * kPi * (i + 0.5) / map.nu;
      // The surroundings of the object, seen from its middle and through itself.
      const Ray ray = {
          bounds.center(),
          {std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi)}};
      Hit hit;
      bool met = true;
      do {
        met = world_.Intersect(ray, hit.t + 1e-6, kFar, &hit);
      } while (met && world_.parts[size_t(hit.shape)].object == object);
      incoming.push_back(
          {ray.direction, met ? Diffuse(hit, ray.At(hit.t)) : world_.Sky(ray), std::sin(theta)});
    }
  }
  const double nearest_cosine = std::pow(1e-3, 1 / sharpness);
  for (const Incoming& out : incoming) {
    Vec3 sum = Vec3::Zero();
    double total = 0;
    for (const Incoming& in : incoming) {
      const double cosine = out.direction.dot(in.direction);
      if (cosine < nearest_cosine) continue;
      const double weight = in.weight * std::pow(cosine, sharpness);
      sum += weight * in.radiance;
      total += weight;
    }
    map.values.push_back(sum / total);
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
  const Vec3 mirror = (d + 2 * cosine * hit.normal).normalized();
  const double longitude = std::atan2(mirror.z(), mirror.x()) / (2 * kPi);
  const double latitude = std::acos(std::clamp(mirror.y(), -1.0, 1.0)) / kPi;
  const Vec3 reflected = reflections_[size_t(world_.parts[size_t(hit.shape)].material)].Sample(
      {longitude - std::floor(longitude), latitude});
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
  return Encoded(hit, ray.At(hit.t), ray.direction);
}

}  // namespace retint::synthetic
