// SPDX-License-Identifier: BSD-3-Clause
#include "synthetic/shapes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace retint::synthetic {
namespace {

constexpr double kPi = std::numbers::pi;

// Roots of a t^2 + 2 b t + c, ascending, computed without cancellation.
bool SolveQuadratic(double a, double b, double c, double (&t)[2]) {
  const double discriminant = b * b - a * c;
  if (discriminant < 0 || a == 0) return false;
  const double q = -(b + std::copysign(std::sqrt(discriminant), b));
  t[0] = q / a;
  t[1] = q != 0 ? c / q : t[0];
  if (t[0] > t[1]) std::swap(t[0], t[1]);
  return true;
}

// The point at which a line o + t d meets a sphere about the origin.
bool MeetSphere(const Vec3& o, const Vec3& d, double radius, double (&t)[2]) {
  return SolveQuadratic(d.squaredNorm(), o.dot(d), o.squaredNorm() - radius * radius, t);
}

double AngleFraction(double y, double x) {
  const double fraction = std::atan2(y, x) / (2 * kPi);
  return fraction < 0 ? fraction + 1 : fraction;
}

class QuadShape : public Shape {
 public:
  QuadShape(const Vec3& origin, const Vec3& edge_u, const Vec3& edge_v)
      : origin_(origin),
        edge_u_(edge_u),
        edge_v_(edge_v),
        normal_(edge_v.cross(edge_u).normalized()) {
    chart_sizes = {{edge_u.norm(), edge_v.norm()}};
    bounds.extend(origin);
    for (const Vec3& edge : {edge_u, edge_v, Vec3(edge_u + edge_v)}) bounds.extend(origin + edge);
  }

  bool Intersect(const Ray& ray, double t_min, double t_max, Hit* hit) const override {
    const double slope = normal_.dot(ray.direction);
    const double t = normal_.dot(origin_ - ray.origin) / slope;
    if (!(t > t_min && t < t_max)) return false;
    const Vec3 d = ray.At(t) - origin_;
    const double u = d.dot(edge_u_) / edge_u_.squaredNorm();
    const double v = d.dot(edge_v_) / edge_v_.squaredNorm();
    if (u < 0 || u > 1 || v < 0 || v > 1) return false;
    const Vec3 normal = slope > 0 ? Vec3(-normal_) : normal_;
    *hit = {t, -1, 0, {u, v}, normal, normal};
    return true;
  }

  Surfel At(int, const Vec2& uv) const override {
    return {origin_ + uv.x() * edge_u_ + uv.y() * edge_v_, normal_};
  }

 private:
  Vec3 origin_, edge_u_, edge_v_, normal_;
};

class SphereShape : public Shape {
 public:
  SphereShape(const Vec3& center, double radius) : center_(center), radius_(radius) {
    chart_sizes = {{2 * kPi * radius, kPi * radius}};
    wraps_u = true;
    bounds = {center - Vec3::Constant(radius), center + Vec3::Constant(radius)};
  }

  bool Intersect(const Ray& ray, double t_min, double t_max, Hit* hit) const override {
    const Vec3 o = ray.origin - center_;
    double roots[2];
    if (!MeetSphere(o, ray.direction, radius_, roots)) return false;
    const double t = roots[0] > t_min ? roots[0] : roots[1];
    if (!(t > t_min && t < t_max)) return false;
    const Vec3 n = (o + t * ray.direction) / radius_;
    const double latitude = std::acos(std::clamp(n.y(), -1.0, 1.0)) / kPi;
    *hit = {t, -1, 0, {AngleFraction(n.z(), n.x()), latitude}, n, n};
    return true;
  }

  Surfel At(int, const Vec2& uv) const override {
    const double phi = 2 * kPi * uv.x(), theta = kPi * uv.y();
    const Vec3 n(std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi));
    return {center_ + radius_ * n, n};
  }

  bool Contains(const Vec3& point) const override { return (point - center_).norm() < radius_; }

 private:
  Vec3 center_;
  double radius_;
};

class RoundedBoxShape : public Shape {
 public:
  RoundedBoxShape(const Vec3& center, const Vec3& half, double radius, double yaw)
      : center_(center),
        half_(half),
        inner_(half - Vec3::Constant(radius)),
        radius_(radius),
        world_from_local_(Eigen::AngleAxisd(yaw, Vec3::UnitY()).toRotationMatrix()) {
    for (int chart = 0; chart < 6; ++chart) {
      const int axis = chart / 2;
      chart_sizes.emplace_back(2 * half[(axis + 1) % 3], 2 * half[(axis + 2) % 3]);
    }
    const Vec3 extent = world_from_local_.cwiseAbs() * half;
    bounds = {center - extent, center + extent};
  }

  bool Intersect(const Ray& ray, double t_min, double t_max, Hit* hit) const override {
    const Vec3 o = world_from_local_.transpose() * (ray.origin - center_);
    const Vec3 d = world_from_local_.transpose() * ray.direction;
    double enter = -std::numeric_limits<double>::infinity(), leave = -enter;
    int axis = 0;
    for (int i = 0; i < 3; ++i) {
      if (d[i] == 0) {
        if (std::abs(o[i]) > half_[i]) return false;
        continue;
      }
      double t0 = (-half_[i] - o[i]) / d[i], t1 = (half_[i] - o[i]) / d[i];
      if (t0 > t1) std::swap(t0, t1);
      if (t0 > enter) enter = t0, axis = i;
      leave = std::min(leave, t1);
    }
    if (enter > leave || leave < t_min || enter > t_max) return false;

    double best = t_max;
    Vec3 normal = Vec3::Zero();
    const Vec3 entry = o + enter * d;
    const int a = (axis + 1) % 3, b = (axis + 2) % 3;
    if (std::abs(entry[a]) <= inner_[a] && std::abs(entry[b]) <= inner_[b]) {
      if (enter <= t_min) return false;
      best = enter;
      normal[axis] = d[axis] > 0 ? -1 : 1;
    } else {
      MeetEdges(o, d, t_min, &best, &normal);
    }
    if (!(best < t_max)) return false;
    const Vec3 p = o + best * d;
    normal.cwiseAbs().maxCoeff(&axis);
    const int j = (axis + 1) % 3, k = (axis + 2) % 3;
    const Vec3 turned = world_from_local_ * normal;
    *hit = {best,
            -1,
            2 * axis + (normal[axis] > 0 ? 1 : 0),
            {0.5 + 0.5 * p[j] / half_[j], 0.5 + 0.5 * p[k] / half_[k]},
            turned,
            turned};
    return true;
  }

  Surfel At(int chart, const Vec2& uv) const override {
    const int axis = chart / 2, a = (axis + 1) % 3, b = (axis + 2) % 3;
    const double side = chart % 2 ? 1 : -1;
    Vec3 p, n;
    p[a] = (2 * uv.x() - 1) * half_[a];
    p[b] = (2 * uv.y() - 1) * half_[b];
    Vec2 off(p[a] - std::clamp(p[a], -inner_[a], inner_[a]),
             p[b] - std::clamp(p[b], -inner_[b], inner_[b]));
    // Past 45 degrees the neighboring chart takes over; stay on the surface for interpolation.
    const double limit = 0.72 * radius_;
    if (off.norm() > limit) {
      const Vec2 inside = off * (limit / off.norm());
      p[a] += inside.x() - off.x();
      p[b] += inside.y() - off.y();
      off = inside;
    }
    const double rise = std::sqrt(std::max(0.0, radius_ * radius_ - off.squaredNorm()));
    p[axis] = side * (inner_[axis] + rise);
    n[axis] = side * rise;
    n[a] = off.x();
    n[b] = off.y();
    return {center_ + world_from_local_ * p, world_from_local_ * n.normalized()};
  }

  bool Contains(const Vec3& point) const override {
    const Vec3 p = (world_from_local_.transpose() * (point - center_)).cwiseAbs() - inner_;
    return p.cwiseMax(0).norm() + std::min(p.maxCoeff(), 0.0) < radius_;
  }

 private:
  // The first entry into the cylinders along the edges and the spheres at the corners.
  void MeetEdges(const Vec3& o, const Vec3& d, double t_min, double* best, Vec3* normal) const {
    double t[2];
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, k = (i + 2) % 3;
      for (int corner = 0; corner < 4 && d[i] != 0; ++corner) {
        const double oj = o[j] - (corner & 1 ? inner_[j] : -inner_[j]);
        const double ok = o[k] - (corner & 2 ? inner_[k] : -inner_[k]);
        if (SolveQuadratic(d[j] * d[j] + d[k] * d[k], oj * d[j] + ok * d[k],
                           oj * oj + ok * ok - radius_ * radius_, t) &&
            t[0] > t_min && t[0] < *best && std::abs(o[i] + t[0] * d[i]) <= inner_[i]) {
          *best = t[0];
          (*normal)[i] = 0;
          (*normal)[j] = (oj + t[0] * d[j]) / radius_;
          (*normal)[k] = (ok + t[0] * d[k]) / radius_;
        }
      }
    }
    for (int corner = 0; corner < 8; ++corner) {
      const Vec3 c(corner & 1 ? inner_.x() : -inner_.x(), corner & 2 ? inner_.y() : -inner_.y(),
                   corner & 4 ? inner_.z() : -inner_.z());
      if (MeetSphere(o - c, d, radius_, t) && t[0] > t_min && t[0] < *best) {
        *best = t[0];
        *normal = (o - c + t[0] * d) / radius_;
      }
    }
  }

  Vec3 center_, half_, inner_;
  double radius_;
  Eigen::Matrix3d world_from_local_;
};

class LatheShape : public Shape {
 public:
  LatheShape(const Vec3& base, const std::vector<Vec2>& profile) : base_(base) {
    for (size_t i = 0; i + 1 < profile.size(); ++i) {
      const Vec2 step = profile[i + 1] - profile[i];
      if (step.norm() < 1e-9) continue;
      const Vec2 normal = Vec2(step.y(), -step.x()).normalized();
      segments_.push_back({profile[i], profile[i + 1], normal, normal, total_, step.norm()});
      total_ += step.norm();
    }
    for (size_t i = 0; i + 1 < segments_.size(); ++i) {
      const Vec2 n0 = segments_[i].normal1, n1 = segments_[i + 1].normal0;
      if (n0.dot(n1) < std::cos(40 * kPi / 180)) continue;
      segments_[i].normal1 = segments_[i + 1].normal0 = (n0 + n1).normalized();
    }
    min_height_ = max_height_ = profile.front().y();
    for (const Vec2& p : profile) {
      max_radius_ = std::max(max_radius_, p.x());
      min_height_ = std::min(min_height_, p.y());
      max_height_ = std::max(max_height_, p.y());
    }
    chart_sizes = {{2 * kPi * max_radius_, total_}};
    wraps_u = true;
    bounds = {base + Vec3(-max_radius_, -max_height_, -max_radius_),
              base + Vec3(max_radius_, -min_height_, max_radius_)};
  }

  bool Intersect(const Ray& ray, double t_min, double t_max, Hit* hit) const override {
    const Vec3 o = ray.origin - base_;
    const Vec3& d = ray.direction;
    const double oh = -o.y(), dh = -d.y();
    const double radial_a = d.x() * d.x() + d.z() * d.z();
    const double radial_b = o.x() * d.x() + o.z() * d.z();
    const double radial_c = o.x() * o.x() + o.z() * o.z();
    // Part of the ray inside the bounding cylinder's side.
    double begin = t_min, end = t_max, roots[2];
    if (radial_a > 0) {
      if (!SolveQuadratic(radial_a, radial_b, radial_c - max_radius_ * max_radius_ * (1 + 1e-9),
                          roots)) {
        return false;
      }
      begin = std::max(begin, roots[0] - 1e-9);
      end = std::min(end, roots[1] + 1e-9);
      if (begin > end) return false;
    }
    const auto [low, high] = std::minmax({oh + begin * dh, oh + end * dh});

    double best = t_max, best_s = 0;
    const Segment* met = nullptr;
    for (const Segment& segment : segments_) {
      const double h0 = segment.begin.y(), h1 = segment.end.y();
      if (std::max(h0, h1) < low - 1e-9 || std::min(h0, h1) > high + 1e-9) continue;
      if (std::abs(h1 - h0) < 1e-9) {
        const double t = (h0 - oh) / dh;
        if (!(t > t_min && t < best)) continue;
        const double r = std::sqrt(std::max(0.0, radial_c + t * (2 * radial_b + t * radial_a)));
        const double s = (r - segment.begin.x()) / (segment.end.x() - segment.begin.x());
        if (s >= 0 && s <= 1) best = t, best_s = s, met = &segment;
        continue;
      }
      const double k = (segment.end.x() - segment.begin.x()) / (h1 - h0);
      const double r_at_o = segment.begin.x() + k * (oh - h0), dr = k * dh;
      const double a = radial_a - dr * dr;
      if (std::abs(a) < 1e-14 ||
          !SolveQuadratic(a, radial_b - r_at_o * dr, radial_c - r_at_o * r_at_o, roots)) {
        continue;
      }
      for (const double t : roots) {
        const double s = (oh + t * dh - h0) / (h1 - h0);
        if (t > t_min && t < best && s >= 0 && s <= 1 && r_at_o + t * dr >= 0) {
          best = t, best_s = s, met = &segment;
        }
      }
    }
    if (!met) return false;
    const Vec3 p = o + best * d;
    const double r = std::max(1e-12, std::sqrt(p.x() * p.x() + p.z() * p.z()));
    const Vec2 step = met->end - met->begin;
    *hit = {best,
            -1,
            0,
            {AngleFraction(p.z(), p.x()), (met->offset + best_s * met->length) / total_},
            NormalAt(*met, best_s, p.x() / r, p.z() / r),
            Vec3(step.y() * p.x() / r, step.x(), step.y() * p.z() / r) / met->length};
    return true;
  }

  Surfel At(int, const Vec2& uv) const override {
    const double along = std::clamp(uv.y(), 0.0, 1.0) * total_;
    const auto next =
        std::upper_bound(segments_.begin() + 1, segments_.end(), along,
                         [](double value, const Segment& s) { return value < s.offset; });
    const Segment& segment = *(next - 1);
    const double s = std::clamp((along - segment.offset) / segment.length, 0.0, 1.0);
    const Vec2 p = segment.begin + s * (segment.end - segment.begin);
    const double cosine = std::cos(2 * kPi * uv.x()), sine = std::sin(2 * kPi * uv.x());
    return {base_ + Vec3(p.x() * cosine, -p.y(), p.x() * sine), NormalAt(segment, s, cosine, sine)};
  }

  bool Contains(const Vec3& point) const override {
    const double r = std::hypot(point.x() - base_.x(), point.z() - base_.z());
    const double h = base_.y() - point.y();
    if (r > max_radius_ || h < min_height_ || h > max_height_) return false;
    // Crossings towards larger radii decide; a point on the profile is not inside.
    bool inside = false, on_profile = false;
    for (const Segment& s : segments_) {
      const Vec2 step = s.end - s.begin, from_begin = Vec2(r, h) - s.begin;
      inside ^= (s.begin.y() > h) != (s.end.y() > h) &&
                s.begin.x() + (h - s.begin.y()) / step.y() * step.x() > r;
      const double along = std::clamp(from_begin.dot(step) / step.squaredNorm(), 0.0, 1.0);
      on_profile |= (from_begin - along * step).norm() == 0;
    }
    return inside && !on_profile;
  }

 private:
  struct Segment {
    Vec2 begin, end;        // radius, height
    Vec2 normal0, normal1;  // radius, height
    double offset, length;
  };

  Vec3 NormalAt(const Segment& segment, double s, double cosine, double sine) const {
    const Vec2 n = ((1 - s) * segment.normal0 + s * segment.normal1).normalized();
    return {n.x() * cosine, -n.y(), n.x() * sine};
  }

  Vec3 base_;
  std::vector<Segment> segments_;
  double total_ = 0, max_radius_ = 0, min_height_ = 0, max_height_ = 0;
};

class CapsuleShape : public Shape {
 public:
  CapsuleShape(const Vec3& a, const Vec3& b, double radius)
      : a_(a), axis_((b - a).normalized()), length_((b - a).norm()), radius_(radius) {
    side_ = axis_.unitOrthogonal();
    up_ = axis_.cross(side_);
    chart_sizes = {{2 * kPi * radius, length_}};
    wraps_u = true;
    bounds.extend(a);
    bounds.extend(Vec3(a + length_ * axis_));
    bounds = {bounds.min() - Vec3::Constant(radius), bounds.max() + Vec3::Constant(radius)};
  }

  bool Intersect(const Ray& ray, double t_min, double t_max, Hit* hit) const override {
    const Vec3 o = ray.origin - a_;
    const Vec3& d = ray.direction;
    const double oa = o.dot(axis_), da = d.dot(axis_);
    const Vec3 op = o - oa * axis_, dp = d - da * axis_;
    double best = t_max, roots[2];
    if (SolveQuadratic(dp.squaredNorm(), op.dot(dp), op.squaredNorm() - radius_ * radius_, roots)) {
      for (const double t : roots) {
        const double along = oa + t * da;
        if (t > t_min && t < best && along >= 0 && along <= length_) best = t;
      }
    } else if (dp.squaredNorm() > 0) {
      return false;
    }
    for (const double end : {0.0, length_}) {
      if (!MeetSphere(o - end * axis_, d, radius_, roots)) continue;
      for (const double t : roots) {
        const double along = oa + t * da;
        if (t > t_min && t < best && (end == 0 ? along < 0 : along > length_)) best = t;
      }
    }
    if (!(best < t_max)) return false;
    const Vec3 p = o + best * d;
    const double along = std::clamp(p.dot(axis_), 0.0, length_);
    const Vec3 n = (p - along * axis_) / radius_;
    *hit = {best, -1, 0, {AngleFraction(n.dot(up_), n.dot(side_)), along / length_}, n, n};
    return true;
  }

  Surfel At(int, const Vec2& uv) const override {
    const double phi = 2 * kPi * uv.x();
    const Vec3 n = std::cos(phi) * side_ + std::sin(phi) * up_;
    return {a_ + uv.y() * length_ * axis_ + radius_ * n, n};
  }

  bool Contains(const Vec3& point) const override {
    const Vec3 p = point - a_;
    const double along = std::clamp(p.dot(axis_), 0.0, length_);
    return (p - along * axis_).norm() < radius_;
  }

  std::optional<Strand> StrandAt(const Vec3& point) const override {
    const double along = std::clamp(axis_.dot(point - a_), 0.0, length_);
    return Strand{a_ + along * axis_, axis_, radius_};
  }

 private:
  Vec3 a_, axis_, side_, up_;
  double length_, radius_;
};

class LeafShape : public Shape {
 public:
  LeafShape(const Vec3& base, const Vec3& along, const Vec3& up, const LeafForm& form)
      : base_(base), form_(form) {
    const Vec3 x = along.normalized();
    const Vec3 y = up.cross(x).normalized();
    world_from_local_ << x, y, x.cross(y);
    const double half = form.length / 2;
    drop_ = std::sqrt(form.bend * form.bend - form.fold * form.fold - half * half);
    chart_sizes.assign(2, {form.length, form.width});
    constexpr int kSteps = 12;
    for (int i = 0; i < (kSteps + 1) * (kSteps + 1); ++i) {
      bounds.extend(
          LeafShape::At(0, {double(i / (kSteps + 1)) / kSteps, double(i % (kSteps + 1)) / kSteps})
              .point);
    }
    const Vec3 slack = Vec3::Constant(0.02 * form.length);
    bounds = {bounds.min() - slack, bounds.max() + slack};
  }

  bool Intersect(const Ray& ray, double t_min, double t_max, Hit* hit) const override {
    const Vec3 o = world_from_local_.transpose() * (ray.origin - base_);
    const Vec3 d = world_from_local_.transpose() * ray.direction;
    double best = t_max, roots[2];
    Vec3 normal = Vec3::Zero();
    Vec2 uv = Vec2::Zero();
    for (const double side : {-1.0, 1.0}) {
      const Vec3 oc = o - Vec3(form_.length / 2, side * form_.fold, -drop_);
      if (!MeetSphere(oc, d, form_.bend, roots)) continue;
      for (const double t : roots) {
        if (!(t > t_min && t < best)) continue;
        const Vec3 p = o + t * d, n = (oc + t * d) / form_.bend;
        if (n.z() <= 0 || p.y() * side < 0) continue;
        if (std::abs(p.y()) > HalfWidth(p.x() / form_.length)) continue;
        best = t;
        normal = n;
        uv = {p.x() / form_.length, 0.5 + p.y() / form_.width};
      }
    }
    if (!(best < t_max)) return false;
    const bool upper = normal.dot(d) < 0;
    const Vec3 turned = world_from_local_ * (upper ? normal : Vec3(-normal));
    *hit = {best, -1, upper ? 0 : 1, uv, turned, turned};
    return true;
  }

  Surfel At(int chart, const Vec2& uv) const override {
    const double y = (uv.y() - 0.5) * form_.width;
    const double side = y < 0 ? -1 : 1;
    Vec3 n((uv.x() - 0.5) * form_.length, y - side * form_.fold, 0);
    n.z() = std::sqrt(std::max(1e-12, form_.bend * form_.bend - n.squaredNorm()));
    const Vec3 p = n + Vec3(form_.length / 2, side * form_.fold, -drop_);
    return {base_ + world_from_local_ * p,
            world_from_local_ * (n.normalized() * (chart == 0 ? 1.0 : -1.0))};
  }

 private:
  double HalfWidth(double u) const {
    if (u <= 0 || u >= 1) return 0;
    return 0.5 * form_.width * std::pow(std::sin(kPi * std::pow(u, 0.8)), form_.tip);
  }

  Vec3 base_;
  LeafForm form_;
  double drop_;  // of the spheres' centers, so that the crease begins at the base
  Eigen::Matrix3d world_from_local_;
};

}  // namespace

ShapePtr Quad(const Vec3& origin, const Vec3& edge_u, const Vec3& edge_v) {
  return std::make_unique<QuadShape>(origin, edge_u, edge_v);
}
ShapePtr Sphere(const Vec3& center, double radius) {
  return std::make_unique<SphereShape>(center, radius);
}
ShapePtr RoundedBox(const Vec3& center, const Vec3& half, double radius, double yaw) {
  return std::make_unique<RoundedBoxShape>(center, half, radius, yaw);
}
ShapePtr Lathe(const Vec3& base, const std::vector<Vec2>& profile) {
  return std::make_unique<LatheShape>(base, profile);
}
ShapePtr Capsule(const Vec3& a, const Vec3& b, double radius) {
  return std::make_unique<CapsuleShape>(a, b, radius);
}
ShapePtr Leaf(const Vec3& base, const Vec3& along, const Vec3& up, const LeafForm& form) {
  return std::make_unique<LeafShape>(base, along, up, form);
}

}  // namespace retint::synthetic
