// SPDX-License-Identifier: BSD-3-Clause
// Analytic surfaces of the synthetic scenes: exact ray hits, exact normals, and charts (u, v in
// [0, 1]) on which light is baked. World frame: x right, y down, z away from the viewer, meters.
// Internal to the synthetic scenes.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace retint::synthetic {

using Vec2 = Eigen::Vector2d;
using Vec3 = Eigen::Vector3d;

struct Ray {
  Vec3 origin;
  Vec3 direction;  // any length; hits report t in its units
  Vec3 At(double t) const { return origin + t * direction; }
};

// A place on a surface, with its unit normal.
struct Surfel {
  Vec3 point, normal;
};

struct Hit {
  double t = 0;
  int shape = -1;  // index in the world
  int chart = 0;
  Vec2 uv = {0, 0};
  Vec3 normal;  // unit, outward; of sheets: towards the ray's origin; smooth for shading
  Vec3 face;    // the surface's own normal, which differs on turned shapes only
};

// The piece of a rod's axis nearest to a point.
struct Strand {
  Vec3 point, direction;
  double radius;
};

class Shape {
 public:
  virtual ~Shape() = default;
  // Nearest hit with t in (t_min, t_max); fills everything but `shape`.
  virtual bool Intersect(const Ray& ray, double t_min, double t_max, Hit* hit) const = 0;
  virtual Surfel At(int chart, const Vec2& uv) const = 0;
  // Whether a closed shape has `point` inside; sheets have no inside.
  virtual bool Contains(const Vec3& /*point*/) const { return false; }
  // Only rods, which are too thin for a surface of discs, have one.
  virtual std::optional<Strand> StrandAt(const Vec3& /*point*/) const { return std::nullopt; }

  std::vector<Vec2> chart_sizes;  // width and height in meters
  bool wraps_u = false;
  Eigen::AlignedBox3d bounds;
};

using ShapePtr = std::unique_ptr<Shape>;

// Rectangle origin + u * edge_u + v * edge_v, edges at right angles, like a picture: lit and meant
// to be seen from where u runs to the right and v downwards. Hits report the normal towards the
// ray's origin.
ShapePtr Quad(const Vec3& origin, const Vec3& edge_u, const Vec3& edge_v);
ShapePtr Sphere(const Vec3& center, double radius);
// Box with rounded edges (radius > 0), turned about the vertical. Charts: -x, +x, -y, +y, -z, +z.
ShapePtr RoundedBox(const Vec3& center, const Vec3& half, double radius, double yaw = 0);
// Surface of revolution about a vertical axis: a polyline of (radius, height above base), walked
// with the outside on its right. Normals are smooth except at creases of more than 40 degrees.
ShapePtr Lathe(const Vec3& base, const std::vector<Vec2>& profile);
ShapePtr Capsule(const Vec3& a, const Vec3& b, double radius);

// A thin leaf: two sheets, each cut from a sphere, that meet in a crease along the midrib. Its
// frame has x along the midrib from the base, y across, z up. There |y| is at most the half width
// at x / L, and z is sqrt(R^2 - (x - L/2)^2 - (|y| - s)^2) - sqrt(R^2 - s^2 - L^2 / 4).
// Charts: upper side, lower side; u along, v across.
struct LeafForm {
  double length, width;  // meters
  double bend;           // R: radius of the spheres
  double fold;           // s: how far the crease lifts the sides
  double tip;            // outline exponent: larger is more pointed
};
ShapePtr Leaf(const Vec3& base, const Vec3& along, const Vec3& up, const LeafForm& form);

}  // namespace retint::synthetic
