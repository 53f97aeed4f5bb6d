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
};

// A place on a surface: chart coordinates, and the unit normal on the side that was hit.
struct Surfel {
  Vec3 point;
  Vec3 normal;
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
  // Whether a closed shape has `point` inside by more than `margin`; sheets have no inside.
  virtual bool Contains(const Vec3& /*point*/, double /*margin*/) const { return false; }
  // Of rods, which are too thin for a surface of discs.
  virtual std::optional<Strand> StrandAt(const Vec3& /*point*/) const { return std::nullopt; }
  // Width and height of every chart in meters.
  virtual std::vector<Vec2> ChartSizes() const = 0;
  virtual bool WrapsU() const { return false; }
  virtual Eigen::AlignedBox3d Bounds() const = 0;
};

// Rectangle origin + u * edge_u + v * edge_v, edges at right angles, like a picture: lit and meant
// to be seen from where u runs to the right and v downwards. Hits report the normal towards the
// ray's origin.
class Quad : public Shape {
 public:
  Quad(const Vec3& origin, const Vec3& edge_u, const Vec3& edge_v);
  bool Intersect(const Ray& ray, double t_min, double t_max, Hit* hit) const override;
  Surfel At(int chart, const Vec2& uv) const override;
  std::vector<Vec2> ChartSizes() const override;
  Eigen::AlignedBox3d Bounds() const override;

 private:
  Vec3 origin_, edge_u_, edge_v_, normal_;
};

class Sphere : public Shape {
 public:
  Sphere(const Vec3& center, double radius) : center_(center), radius_(radius) {}
  bool Intersect(const Ray& ray, double t_min, double t_max, Hit* hit) const override;
  Surfel At(int chart, const Vec2& uv) const override;
  bool Contains(const Vec3& point, double margin) const override;
  std::vector<Vec2> ChartSizes() const override;
  bool WrapsU() const override { return true; }
  Eigen::AlignedBox3d Bounds() const override;

 private:
  Vec3 center_;
  double radius_;
};

// Box with rounded edges, turned about the vertical. Charts: -x, +x, -y, +y, -z, +z.
class RoundedBox : public Shape {
 public:
  RoundedBox(const Vec3& center, const Vec3& half, double radius, double yaw = 0);
  bool Intersect(const Ray& ray, double t_min, double t_max, Hit* hit) const override;
  Surfel At(int chart, const Vec2& uv) const override;
  bool Contains(const Vec3& point, double margin) const override;
  std::vector<Vec2> ChartSizes() const override;
  Eigen::AlignedBox3d Bounds() const override;

 private:
  void Finish(const Vec3& local, const Vec3& normal, double t, Hit* hit) const;
  Vec3 center_, half_, inner_;
  double radius_;
  Eigen::Matrix3d world_from_local_;
};

// Surface of revolution about a vertical axis: a polyline of (radius, height above base), walked
// with the outside on its right. Normals are smooth except at creases of more than 40 degrees.
class Lathe : public Shape {
 public:
  Lathe(const Vec3& base, std::vector<Vec2> profile);
  bool Intersect(const Ray& ray, double t_min, double t_max, Hit* hit) const override;
  Surfel At(int chart, const Vec2& uv) const override;
  bool Contains(const Vec3& point, double margin) const override;
  std::vector<Vec2> ChartSizes() const override;
  bool WrapsU() const override { return true; }
  Eigen::AlignedBox3d Bounds() const override;

 private:
  struct Segment {
    Vec2 begin, end;        // radius, height
    Vec2 normal0, normal1;  // radius, height
    double offset, length;
  };
  Vec3 NormalAt(const Segment& segment, double s, double cosine, double sine) const;
  Vec3 base_;
  std::vector<Segment> segments_;
  double total_ = 0, max_radius_ = 0, min_height_ = 0, max_height_ = 0;
};

class Capsule : public Shape {
 public:
  Capsule(const Vec3& a, const Vec3& b, double radius);
  bool Intersect(const Ray& ray, double t_min, double t_max, Hit* hit) const override;
  Surfel At(int chart, const Vec2& uv) const override;
  bool Contains(const Vec3& point, double margin) const override;
  std::optional<Strand> StrandAt(const Vec3& point) const override;
  std::vector<Vec2> ChartSizes() const override;
  bool WrapsU() const override { return true; }
  Eigen::AlignedBox3d Bounds() const override;

 private:
  Vec3 a_, axis_, side_, up_;
  double length_, radius_;
};

// A thin leaf: two sheets, each cut from a sphere, that meet in a crease along the midrib. In its
// frame (x along the midrib from the base, y across, z up) z is
// sqrt(R^2 - (x - L/2)^2 - (|y| - s)^2) - sqrt(R^2 - s^2 - L^2 / 4), inside |y| <= HalfWidth(x /
// L). Charts: upper side, lower side; u along, v across.
class Leaf : public Shape {
 public:
  struct Form {
    double length, width;  // meters
    double bend;           // R: radius of the spheres
    double fold;           // s: how far the crease lifts the sides
    double tip;            // outline exponent: larger is more pointed
  };
  Leaf(const Vec3& base, const Vec3& along, const Vec3& up, const Form& form);
  bool Intersect(const Ray& ray, double t_min, double t_max, Hit* hit) const override;
  Surfel At(int chart, const Vec2& uv) const override;
  std::vector<Vec2> ChartSizes() const override;
  Eigen::AlignedBox3d Bounds() const override;
  double HalfWidth(double u) const;

 private:
  double Drop() const;  // of the spheres' centers, so that the crease begins at the base
  Vec3 base_;
  Form form_;
  Eigen::Matrix3d world_from_local_;
};

}  // namespace retint::synthetic
