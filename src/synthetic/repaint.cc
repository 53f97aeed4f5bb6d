// SPDX-License-Identifier: BSD-3-Clause
#include "synthetic/repaint.h"

#include <algorithm>
#include <set>
#include <utility>

#include "kernels/common/color_spaces.h"
#include "synthetic/views.h"

namespace retint::synthetic {
namespace {

constexpr int kRays = 96;             // a side, of every camera
constexpr double kMostAlbedo = 0.98;  // nothing reflects all light

double Luminance(const Vec3& color) { return color.dot(Vec3(0.2126, 0.7152, 0.0722)); }

double MeanLuminance(const World& world, int object, const std::vector<PosedCamera>& cameras) {
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
      sum += Luminance(world.Albedo(hit, ray.origin + hit.t * ray.direction));
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

void Paste(World& world, int object, const Image8& picture) {
  for (const Part& part : world.parts) {
    if (part.object != object) continue;
    world.materials[size_t(part.material)].albedo = [picture](const TexturePoint& at) {
      return Sample(picture, at.uv);
    };
    return;
  }
}

void Repaint(World& world, int object, const Vec3& albedo,
             const std::vector<PosedCamera>& cameras) {
  const double mean = MeanLuminance(world, object, cameras);
  std::set<int> materials;  // of this object alone
  for (const Part& part : world.parts) {
    if (part.object == object) materials.insert(part.material);
  }
  for (const int index : materials) {
    Material& material = world.materials[size_t(index)];
    material.albedo = [old = std::move(material.albedo), albedo, mean](const TexturePoint& at) {
      return Vec3((albedo * (Luminance(old(at)) / mean)).cwiseMin(kMostAlbedo));
    };
  }
}

}  // namespace retint::synthetic
