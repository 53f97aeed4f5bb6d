// SPDX-License-Identifier: BSD-3-Clause
#include "synthetic/world.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "synthetic/noise.h"

namespace retint::synthetic {
namespace {

constexpr int kLeafParts = 2;
constexpr double kLarge = 2;  // meters

// Whether the ray meets the box before t_max; `inverse` is 1 / direction per axis.
bool Meets(const Eigen::AlignedBox3d& box, const Vec3& origin, const Vec3& inverse, double t_min,
           double t_max) {
  for (int i = 0; i < 3; ++i) {
    double t0 = (box.min()[i] - origin[i]) * inverse[i];
    double t1 = (box.max()[i] - origin[i]) * inverse[i];
    if (t0 > t1) std::swap(t0, t1);
    // A ray in the plane of a slab's face gives NaN, which must not cull.
    if (t0 > t_min) t_min = t0;
    if (t1 < t_max) t_max = t1;
  }
  return t_min <= t_max;
}

}  // namespace

int World::AddObject(std::string name, bool furniture) {
  objects.push_back({std::move(name), furniture});
  return int(objects.size()) - 1;
}

int World::AddMaterial(Material material) {
  materials.push_back(std::move(material));
  return int(materials.size()) - 1;
}

void World::Add(int object, int material, std::unique_ptr<Shape> shape) {
  Eigen::AlignedBox3d bounds = shape->Bounds();
  // Slack against rounding in the slab test, and so that flat boxes have a volume.
  bounds.min().array() -= 1e-7;
  bounds.max().array() += 1e-7;
  parts.push_back({std::move(shape), object, material, bounds});
}

void World::Finish() {
  order_.clear();
  large_.clear();
  parts_of_object_.assign(objects.size(), {});
  chart_sizes_.clear();
  for (size_t i = 0; i < parts.size(); ++i) {
    (parts[i].bounds.sizes().maxCoeff() > kLarge ? large_ : order_).push_back(int(i));
    chart_sizes_.push_back(parts[i].shape->ChartSizes());
    parts_of_object_[size_t(parts[i].object)].push_back(int(i));
  }
  nodes_.assign(1, Node{});
  Build(0, 0, int(order_.size()));
}

void World::Build(int node, int begin, int end) {
  Eigen::AlignedBox3d bounds, centers;
  for (int i = begin; i < end; ++i) {
    bounds.extend(parts[size_t(order_[size_t(i)])].bounds);
    centers.extend(parts[size_t(order_[size_t(i)])].bounds.center());
  }
  nodes_[size_t(node)].bounds = bounds;
  if (end - begin <= kLeafParts) {
    nodes_[size_t(node)].begin = begin;
    nodes_[size_t(node)].end = end;
    return;
  }
  int axis;
  centers.sizes().maxCoeff(&axis);
  const int middle = (begin + end) / 2;
  std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                   [&](int a, int b) {
                     const double ca = parts[size_t(a)].bounds.center()[axis];
                     const double cb = parts[size_t(b)].bounds.center()[axis];
                     return ca != cb ? ca < cb : a < b;
                   });
  const int child = int(nodes_.size());
  nodes_.resize(nodes_.size() + 2);
  nodes_[size_t(node)].begin = child;
  nodes_[size_t(node)].end = 0;
  nodes_[size_t(node)].axis = axis;
  Build(child, begin, middle);
  Build(child + 1, middle, end);
}

template <bool kAny>
bool World::Trace(const Ray& ray, double t_min, double t_max, Hit* hit) const {
  const Vec3 inverse = ray.direction.cwiseInverse();
  bool found = false;
  const auto test = [&](int part) {
    if (!parts[size_t(part)].shape->Intersect(ray, t_min, t_max, hit)) return false;
    found = true;
    t_max = hit->t;
    hit->shape = part;
    return true;
  };
  int stack[64];
  int top = 0;
  stack[top++] = 0;
  while (top > 0) {
    const Node& node = nodes_[size_t(stack[--top])];
    if (!Meets(node.bounds, ray.origin, inverse, t_min, t_max)) continue;
    if (node.end == 0) {
      // The nearer child is taken first.
      const bool flip = ray.direction[node.axis] < 0;
      stack[top++] = node.begin + (flip ? 0 : 1);
      stack[top++] = node.begin + (flip ? 1 : 0);
      continue;
    }
    for (int i = node.begin; i < node.end; ++i) {
      const int part = order_[size_t(i)];
      if (node.end - node.begin > 1 &&
          !Meets(parts[size_t(part)].bounds, ray.origin, inverse, t_min, t_max)) {
        continue;
      }
      if (test(part) && kAny) return true;
    }
  }
  for (const int part : large_) {
    if (Meets(parts[size_t(part)].bounds, ray.origin, inverse, t_min, t_max) && test(part) &&
        kAny) {
      return true;
    }
  }
  return found;
}

bool World::Intersect(const Ray& ray, double t_min, double t_max, Hit* hit) const {
  return Trace<false>(ray, t_min, t_max, hit);
}

bool World::Occluded(const Ray& ray, double t_min, double t_max) const {
  Hit hit;
  return Trace<true>(ray, t_min, t_max, &hit);
}

bool World::IntersectObject(int object, const Ray& ray, double t_min, double t_max,
                            Hit* hit) const {
  const Vec3 inverse = ray.direction.cwiseInverse();
  bool found = false;
  for (const int part : parts_of_object_[size_t(object)]) {
    const Part& candidate = parts[size_t(part)];
    if (Meets(candidate.bounds, ray.origin, inverse, t_min, t_max) &&
        candidate.shape->Intersect(ray, t_min, t_max, hit)) {
      found = true;
      t_max = hit->t;
      hit->shape = part;
    }
  }
  return found;
}

bool World::Buried(const Vec3& point, int except) const {
  for (size_t i = 0; i < parts.size(); ++i) {
    if (int(i) != except && parts[i].bounds.contains(point) && parts[i].shape->Contains(point, 0)) {
      return true;
    }
  }
  return false;
}

TexturePoint World::Locate(const Hit& hit, const Vec3& point) const {
  const Vec2& size = chart_sizes_[size_t(hit.shape)][size_t(hit.chart)];
  return {point, hit.normal, hit.chart, hit.uv, hit.uv.cwiseProduct(size)};
}

Vec3 World::Environment(const Vec3& direction) const {
  const Vec3 d = direction.normalized();
  const Vec3 low(0.12, 0.10, 0.08), horizon(0.26, 0.255, 0.25), zenith(0.42, 0.46, 0.52);
  const double up = -d.y();
  return up < 0 ? Vec3(horizon + Smooth(0, 0.7, -up) * (low - horizon))
                : Vec3(horizon + Smooth(0, 1, up) * (zenith - horizon));
}

Vec3 World::Sky(const Ray& ray) const {
  const Vec3 n = light.Normal();
  const double slope = n.dot(ray.direction);
  if (slope < 0) {
    const double t = n.dot(light.center - ray.origin) / slope;
    const Vec3 p = ray.origin + t * ray.direction - light.center;
    if (t > 0 && std::abs(p.dot(light.half_u)) < light.half_u.squaredNorm() &&
        std::abs(p.dot(light.half_v)) < light.half_v.squaredNorm()) {
      return light.radiance;
    }
  }
  return Environment(ray.direction);
}

Vec3 Encode(const Vec3& radiance, double exposure) {
  Vec3 out;
  for (int c = 0; c < 3; ++c) {
    // K. Narkowicz's rational fit of the ACES filmic curve.
    const double x = std::max(0.0, radiance[c] * exposure);
    const double y = std::clamp(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14), 0.0, 1.0);
    out[c] = y <= 0.0031308 ? 12.92 * y : 1.055 * std::pow(y, 1 / 2.4) - 0.055;
  }
  return out;
}

}  // namespace retint::synthetic
