// SPDX-License-Identifier: BSD-3-Clause
// A synthetic world: objects made of shapes and materials, one rectangular area light, and the
// light that enters from outside. Internal to the synthetic scenes.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "scene/camera.h"
#include "scene/image.h"
#include "synthetic/shapes.h"

namespace retint::synthetic {

// The inputs of a texture. `chart_xy` is uv times the chart's size: meters on the surface.
struct TexturePoint {
  Vec3 point;
  Vec3 normal;
  int chart;
  Vec2 uv;
  Vec2 chart_xy;
};

struct Material {
  std::function<Vec3(const TexturePoint&)> albedo;  // linear RGB
  double specular = 0;      // reflectance at normal incidence (Schlick's F0); 0: purely diffuse
  double sharpness = 30;    // exponent of the reflected lobe, cos^n about the mirror direction
  bool metal = false;       // reflects in its own color, no diffuse part
  double translucency = 0;  // of sheets: share of the far side's light that shines through
  bool textureless = false;
};

struct Part {
  ShapePtr shape;
  int object = 0;    // index in World::objects
  int material = 0;  // index in World::materials
};

struct Object {
  std::string name;
  bool furniture = false;  // not meant to be selected: the room, and objects that others bury
  std::vector<int> parts = {};
};

struct AreaLight {
  Vec3 center, half_u, half_v;
  Vec3 radiance;
  Vec3 Normal() const { return half_u.cross(half_v).normalized(); }
  double Area() const { return 4 * half_u.cross(half_v).norm(); }
};

class World {
 public:
  int AddObject(std::string name, bool furniture = false);
  int AddMaterial(Material material);
  void Add(int object, int material, ShapePtr shape);
  // Builds the bounding volume hierarchy; call once, after the last Add.
  void Finish();

  // The nearest hit with t in (t_min, t_max).
  bool Intersect(const Ray& ray, double t_min, double t_max, Hit* hit) const;
  // As Intersect, with the parts of one object only.
  bool IntersectObject(const Object& object, const Ray& ray, double t_min, double t_max,
                       Hit* hit) const;
  bool Occluded(const Ray& ray, double t_min, double t_max) const;
  // Whether a closed part other than `except` has the point inside.
  bool Buried(const Vec3& point, int except) const;

  TexturePoint Locate(const Hit& hit, const Vec3& point) const;
  const Material& MaterialOf(int part) const { return materials[size_t(parts[part].material)]; }
  const Object& ObjectOf(int part) const { return objects[size_t(parts[size_t(part)].object)]; }
  Vec3 Albedo(const Hit& hit, const Vec3& point) const {
    return MaterialOf(hit.shape).albedo(Locate(hit, point));
  }
  // Radiance that arrives from outside the room along -direction.
  Vec3 Environment(const Vec3& direction) const;
  // The same, or the area light's if the ray meets it.
  Vec3 Sky(const Ray& ray) const;

  std::vector<Object> objects = {{"background", true}};
  std::vector<Material> materials;
  std::vector<Part> parts;
  AreaLight light;
  double exposure = 1;

 private:
  struct Node {
    Eigen::AlignedBox3d bounds;
    int begin = 0, end = 0;  // leaf: range of order_; inner: end == 0, children begin, begin + 1
    int axis = 0;            // inner: along which the children were parted
  };
  void Build(size_t node, int begin, int end);
  // Whether there is a hit: the nearest, or any.
  bool Trace(const Ray& ray, double t_min, double t_max, bool any, Hit* hit) const;
  // Whether one of the parts is hit nearer than `t_max`, which becomes the nearest hit's.
  bool Test(std::span<const int> parts, const Ray& ray, double t_min, double* t_max,
            Hit* hit) const;

  std::vector<Node> nodes_;
  std::vector<int> order_;  // small parts, as the nodes refer to them
  std::vector<int> large_;  // the room, tested one by one: it would blow up the nodes' boxes
};

// The ray through a pixel position whose t is z.
Ray PixelRay(const PosedCamera& camera, double x, double y);

// Display encoding of linear radiance: exposure, a filmic curve, the sRGB transfer function.
Vec3 Encode(const Vec3& radiance, double exposure);

// Gives an object another color. Surface of its mean luminance, over the parts that `cameras` see,
// becomes `albedo` (linear RGB). A pattern stays, as lighter and darker shades. Baked light, gloss
// and shape stay as they are, so nothing else in a picture changes.
void Repaint(World& world, int object, const Vec3& albedo, const std::vector<PosedCamera>& cameras);

// Pastes a picture (display-encoded) on every chart of the object's first part, its body: u runs to
// the right, v down.
void Paste(World& world, int object, const Image8& picture);

enum class Room {
  kPapered,
  kBare,  // no wallpaper
  kOpen,  // no walls, and floor all around
};

// A table in a room, with a ball, a gift box, a candlestick, a potted plant and a pear.
World MakeStillLife(uint64_t seed, Room room);

}  // namespace retint::synthetic
