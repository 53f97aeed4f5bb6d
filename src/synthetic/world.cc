// SPDX-License-Identifier: BSD-3-Clause
#include "synthetic/world.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "kernels/common/color_spaces.h"
#include "synthetic/noise.h"

namespace retint::synthetic {
namespace {

constexpr double kMostAlbedo = 0.98;  // nothing reflects all light

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

double Luminance(const Vec3& color) { return color.dot(Vec3(0.2126, 0.7152, 0.0722)); }

// Of the object's albedo, over the pixels of all cameras that show it.
double MeanLuminance(const World& world, int object, const std::vector<PosedCamera>& cameras) {
  constexpr int kRays = 96;  // a side, of every camera
  double sum = 0;
  int64_t count = 0;
  for (const PosedCamera& camera : cameras) {
    for (int i = 0; i < kRays * kRays; ++i) {
      const double x = (i % kRays + 0.5) / kRays * camera.camera.width;
      const double y = (i / kRays + 0.5) / kRays * camera.camera.height;
      const Ray ray = PixelRay(camera, x, y);
      Hit hit;
      if (!world.Intersect(ray, 1e-6, 1e3, &hit)) continue;
      if (world.parts[size_t(hit.shape)].object != object) continue;
      sum += Luminance(world.Albedo(hit, ray.At(hit.t)));
      ++count;
    }
  }
  return count > 0 ? sum / double(count) : 1;
}

// Bilinear, in linear light.
Vec3 Sample(const Image8& picture, const Vec2& uv) {
  const double x = std::clamp(uv[0] * picture.width - 0.5, 0.0, picture.width - 1.0);
  const double y = std::clamp(uv[1] * picture.height - 0.5, 0.0, picture.height - 1.0);
  Vec3 color = Vec3::Zero();
  for (int i = 0; i < 4; ++i) {
    const int px = std::min(int(x) + i % 2, picture.width - 1);
    const int py = std::min(int(y) + i / 2, picture.height - 1);
    const double u = x - int(x), v = y - int(y);
    const double weight = (i % 2 ? u : 1 - u) * (i / 2 ? v : 1 - v);
    for (int c = 0; c < 3; ++c) {
      color[c] += weight * double(LinearFromSrgb(float(picture(px, py, c)) / 255));
    }
  }
  return color.cwiseMin(kMostAlbedo);
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

void World::Add(int object, int material, ShapePtr shape) {
  // Slack against rounding in the slab test, and so that flat boxes have a volume.
  shape->bounds.min().array() -= 1e-7;
  shape->bounds.max().array() += 1e-7;
  objects[size_t(object)].parts.push_back(int(parts.size()));
  parts.push_back({std::move(shape), object, material});
}

void World::Finish() {
  constexpr double kLarge = 2;  // meters
  for (size_t i = 0; i < parts.size(); ++i) {
    const bool large = parts[i].shape->bounds.sizes().maxCoeff() > kLarge;
    (large ? large_ : order_).push_back(int(i));
  }
  nodes_.resize(1);
  Build(0, 0, int(order_.size()));
}

void World::Build(size_t node, int begin, int end) {
  constexpr int kLeafParts = 2;
  const auto bounds_of = [&](int part) { return parts[size_t(part)].shape->bounds; };
  Eigen::AlignedBox3d bounds, centers;
  for (int i = begin; i < end; ++i) {
    bounds.extend(bounds_of(order_[size_t(i)]));
    centers.extend(bounds_of(order_[size_t(i)]).center());
  }
  if (end - begin <= kLeafParts) {
    nodes_[node] = {bounds, begin, end, 0};
    return;
  }
  int axis;
  centers.sizes().maxCoeff(&axis);
  const int middle = (begin + end) / 2, child = int(nodes_.size());
  std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                   [&](int a, int b) {
                     return std::pair(bounds_of(a).center()[axis], a) <
                            std::pair(bounds_of(b).center()[axis], b);
                   });
  nodes_.resize(nodes_.size() + 2);
  nodes_[node] = {bounds, child, 0, axis};
  Build(size_t(child), begin, middle);
  Build(size_t(child) + 1, middle, end);
}

bool World::Test(std::span<const int> candidates, const Ray& ray, double t_min, double* t_max,
                 Hit* hit) const {
  const Vec3 inverse = ray.direction.cwiseInverse();
  bool found = false;
  for (const int part : candidates) {
    const Shape& shape = *parts[size_t(part)].shape;
    if (!Meets(shape.bounds, ray.origin, inverse, t_min, *t_max) ||
        !shape.Intersect(ray, t_min, *t_max, hit)) {
      continue;
    }
    found = true;
    *t_max = hit->t;
    hit->shape = part;
  }
  return found;
}

bool World::Trace(const Ray& ray, double t_min, double t_max, bool any, Hit* hit) const {
  const Vec3 inverse = ray.direction.cwiseInverse();
  bool found = false;
  int stack[64] = {0};
  for (int top = 1; top > 0 && !(any && found);) {
    const Node& node = nodes_[size_t(stack[--top])];
    if (!Meets(node.bounds, ray.origin, inverse, t_min, t_max)) continue;
    if (node.end == 0) {
      const bool flip = ray.direction[node.axis] < 0;
      stack[top++] = node.begin + (flip ? 0 : 1);
      stack[top++] = node.begin + (flip ? 1 : 0);  // the nearer child, which is taken first
    } else {
      const std::span leaf(&order_[size_t(node.begin)], size_t(node.end - node.begin));
      found |= Test(leaf, ray, t_min, &t_max, hit);
    }
  }
  return (any && found) || Test(large_, ray, t_min, &t_max, hit) || found;
}

bool World::IntersectObject(const Object& object, const Ray& ray, double t_min, double t_max,
                            Hit* hit) const {
  return Test(object.parts, ray, t_min, &t_max, hit);
}

bool World::Intersect(const Ray& ray, double t_min, double t_max, Hit* hit) const {
  return Trace(ray, t_min, t_max, /*any=*/false, hit);
}

bool World::Occluded(const Ray& ray, double t_min, double t_max) const {
  Hit hit;
  return Trace(ray, t_min, t_max, /*any=*/true, &hit);
}

bool World::Buried(const Vec3& point, int except) const {
  for (size_t i = 0; i < parts.size(); ++i) {
    const Shape& shape = *parts[i].shape;
    if (int(i) != except && shape.bounds.contains(point) && shape.Contains(point)) return true;
  }
  return false;
}

TexturePoint World::Locate(const Hit& hit, const Vec3& point) const {
  const Vec2& size = parts[size_t(hit.shape)].shape->chart_sizes[size_t(hit.chart)];
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
    const Vec3 p = ray.At(t) - light.center;
    if (t > 0 && std::abs(p.dot(light.half_u)) < light.half_u.squaredNorm() &&
        std::abs(p.dot(light.half_v)) < light.half_v.squaredNorm()) {
      return light.radiance;
    }
  }
  return Environment(ray.direction);
}

Ray PixelRay(const PosedCamera& camera, double x, double y) {
  const Eigen::Vector2d xy = *camera.camera.CamFromImg({x, y});
  return {camera.Center(), camera.cam_from_world.rotation.conjugate() * Vec3(xy.x(), xy.y(), 1.0)};
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

void Paste(World& world, int object, const Image8& picture) {
  const int body = world.objects[size_t(object)].parts.front();
  world.materials[size_t(world.parts[size_t(body)].material)].albedo =
      [picture](const TexturePoint& at) { return Sample(picture, at.uv); };
}

void Repaint(World& world, int object, const Vec3& albedo,
             const std::vector<PosedCamera>& cameras) {
  const double mean = MeanLuminance(world, object, cameras);
  std::set<int> materials;  // no other object shares them
  for (const int part : world.objects[size_t(object)].parts) {
    materials.insert(world.parts[size_t(part)].material);
  }
  for (const int index : materials) {
    Material& material = world.materials[size_t(index)];
    material.albedo = [old = std::move(material.albedo), albedo, mean](const TexturePoint& at) {
      return Vec3((albedo * (Luminance(old(at)) / mean)).cwiseMin(kMostAlbedo));
    };
  }
}

}  // namespace retint::synthetic
