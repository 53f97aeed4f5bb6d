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
bool SolveQuadratic(double a, double b, double c, double* t0, double* t1) {
  const double discriminant = b * b - a * c;
  if (discriminant < 0 || a == 0) return false;
  const double q = -(b + std::copysign(std::sqrt(discriminant), b));
  *t0 = q / a;
  *t1 = q != 0 ? c / q : *t0;
  if (*t0 > *t1) std::swap(*t0, *t1);
  return true;
}

double AngleFraction(double y, double x) {
  const double fraction = std::atan2(y, x) / (2 * kPi);
  return fraction < 0 ? fraction + 1 : fraction;
}

}  // namespace

// ---- Quad ----

Quad::Quad(const Vec3& origin, const Vec3& edge_u, const Vec3& edge_v)
    : origin_(origin),
      edge_u_(edge_u),
      edge_v_(edge_v),
      normal_(edge_v.cross(edge_u).normalized()) {}

bool Quad::Intersect(const Ray& ray, double t_min, double t_max, Hit* hit) const {
  const double slope = normal_.dot(ray.direction);
  if (slope == 0) return false;
  const double t = normal_.dot(origin_ - ray.origin) / slope;
  if (!(t > t_min && t < t_max)) return false;
  const Vec3 d = ray.origin + t * ray.direction - origin_;
  const double u = d.dot(edge_u_) / edge_u_.squaredNorm();
  const double v = d.dot(edge_v_) / edge_v_.squaredNorm();
  if (u < 0 || u > 1 || v < 0 || v > 1) return false;
  hit->t = t;
  hit->chart = 0;
  hit->uv = {u, v};
  hit->normal = hit->face = slope > 0 ? Vec3(-normal_) : normal_;
  return true;
}

Surfel Quad::At(int, const Vec2& uv) const {
  return {origin_ + uv.x() * edge_u_ + uv.y() * edge_v_, normal_};
}

std::vector<Vec2> Quad::ChartSizes() const { return {{edge_u_.norm(), edge_v_.norm()}}; }

Eigen::AlignedBox3d Quad::Bounds() const {
  Eigen::AlignedBox3d box(origin_);
  box.extend(Vec3(origin_ + edge_u_));
  box.extend(Vec3(origin_ + edge_v_));
  box.extend(Vec3(origin_ + edge_u_ + edge_v_));
  return box;
}

// ---- Sphere ----

bool Sphere::Intersect(const Ray& ray, double t_min, double t_max, Hit* hit) const {
  const Vec3 o = ray.origin - center_;
  double t0, t1;
  if (!SolveQuadratic(ray.direction.squaredNorm(), o.dot(ray.direction),
                      o.squaredNorm() - radius_ * radius_, &t0, &t1)) {
    return false;
  }
  const double t = t0 > t_min ? t0 : t1;
  if (!(t > t_min && t < t_max)) return false;
  const Vec3 n = (o + t * ray.direction) / radius_;
  hit->t = t;
  hit->chart = 0;
  hit->normal = hit->face = n;
  hit->uv = {AngleFraction(n.z(), n.x()), std::acos(std::clamp(n.y(), -1.0, 1.0)) / kPi};
  return true;
}

Surfel Sphere::At(int, const Vec2& uv) const {
  const double phi = 2 * kPi * uv.x(), theta = kPi * uv.y();
  const Vec3 n(std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi));
  return {center_ + radius_ * n, n};
}

bool Sphere::Contains(const Vec3& point, double margin) const {
  return (point - center_).norm() < radius_ - margin;
}

std::vector<Vec2> Sphere::ChartSizes() const { return {{2 * kPi * radius_, kPi * radius_}}; }

Eigen::AlignedBox3d Sphere::Bounds() const {
  return {center_ - Vec3::Constant(radius_), center_ + Vec3::Constant(radius_)};
}

// ---- RoundedBox ----

RoundedBox::RoundedBox(const Vec3& center, const Vec3& half, double radius, double yaw)
    : center_(center),
      half_(half),
      inner_(half - Vec3::Constant(radius)),
      radius_(radius),
      world_from_local_(Eigen::AngleAxisd(yaw, Vec3::UnitY()).toRotationMatrix()) {}

void RoundedBox::Finish(const Vec3& local, const Vec3& normal, double t, Hit* hit) const {
  int axis;
  normal.cwiseAbs().maxCoeff(&axis);
  const int a = (axis + 1) % 3, b = (axis + 2) % 3;
  hit->t = t;
  hit->chart = 2 * axis + (normal[axis] > 0 ? 1 : 0);
  hit->uv = {0.5 + 0.5 * local[a] / half_[a], 0.5 + 0.5 * local[b] / half_[b]};
  hit->normal = hit->face = world_from_local_ * normal;
}

bool RoundedBox::Intersect(const Ray& ray, double t_min, double t_max, Hit* hit) const {
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
  Vec3 best_normal = Vec3::Zero();
  const Vec3 entry = o + enter * d;
  const int a = (axis + 1) % 3, b = (axis + 2) % 3;
  if (std::abs(entry[a]) <= inner_[a] && std::abs(entry[b]) <= inner_[b]) {
    if (enter <= t_min) return false;
    best = enter;
    best_normal = Vec3::Zero();
    best_normal[axis] = d[axis] > 0 ? -1 : 1;
  } else {
    if (radius_ <= 0) return false;
    // The convex hull of rounded edges and corners: the first entry among them and the flats wins.
    for (int i = 0; i < 3; ++i) {
      if (d[i] == 0) continue;
      const double t = ((d[i] > 0 ? -half_[i] : half_[i]) - o[i]) / d[i];
      const Vec3 p = o + t * d;
      const int j = (i + 1) % 3, k = (i + 2) % 3;
      if (t > t_min && t < best && std::abs(p[j]) <= inner_[j] && std::abs(p[k]) <= inner_[k]) {
        best = t;
        best_normal = Vec3::Zero();
        best_normal[i] = d[i] > 0 ? -1 : 1;
      }
      for (int corner = 0; corner < 4; ++corner) {
        const double cj = corner & 1 ? inner_[j] : -inner_[j];
        const double ck = corner & 2 ? inner_[k] : -inner_[k];
        double t0, t1;
        const double oj = o[j] - cj, ok = o[k] - ck;
        if (!SolveQuadratic(d[j] * d[j] + d[k] * d[k], oj * d[j] + ok * d[k],
                            oj * oj + ok * ok - radius_ * radius_, &t0, &t1)) {
          continue;
        }
        if (t0 > t_min && t0 < best && std::abs(o[i] + t0 * d[i]) <= inner_[i]) {
          best = t0;
          best_normal[i] = 0;
          best_normal[j] = (oj + t0 * d[j]) / radius_;
          best_normal[k] = (ok + t0 * d[k]) / radius_;
        }
      }
    }
    for (int corner = 0; corner < 8; ++corner) {
      const Vec3 c(corner & 1 ? inner_.x() : -inner_.x(), corner & 2 ? inner_.y() : -inner_.y(),
                   corner & 4 ? inner_.z() : -inner_.z());
      const Vec3 oc = o - c;
      double t0, t1;
      if (SolveQuadratic(d.squaredNorm(), oc.dot(d), oc.squaredNorm() - radius_ * radius_, &t0,
                         &t1) &&
          t0 > t_min && t0 < best) {
        best = t0;
        best_normal = (oc + t0 * d) / radius_;
      }
    }
  }
  if (!(best < t_max)) return false;
  Finish(o + best * d, best_normal, best, hit);
  return true;
}

Surfel RoundedBox::At(int chart, const Vec2& uv) const {
  const int axis = chart / 2, a = (axis + 1) % 3, b = (axis + 2) % 3;
  const double side = chart % 2 ? 1 : -1;
  Vec3 p = Vec3::Zero(), n = Vec3::Zero();
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
  n[axis] = side * (radius_ > 0 ? rise : 1.0);
  n[a] = off.x();
  n[b] = off.y();
  return {center_ + world_from_local_ * p, world_from_local_ * n.normalized()};
}

bool RoundedBox::Contains(const Vec3& point, double margin) const {
  const Vec3 p = (world_from_local_.transpose() * (point - center_)).cwiseAbs() - inner_;
  return p.cwiseMax(0).norm() + std::min(p.maxCoeff(), 0.0) < radius_ - margin;
}

std::vector<Vec2> RoundedBox::ChartSizes() const {
  std::vector<Vec2> sizes;
  for (int chart = 0; chart < 6; ++chart) {
    const int axis = chart / 2;
    sizes.emplace_back(2 * half_[(axis + 1) % 3], 2 * half_[(axis + 2) % 3]);
  }
  return sizes;
}

Eigen::AlignedBox3d RoundedBox::Bounds() const {
  const Vec3 extent = world_from_local_.cwiseAbs() * half_;
  return {center_ - extent, center_ + extent};
}

// ---- Lathe ----

Lathe::Lathe(const Vec3& base, std::vector<Vec2> profile) : base_(base) {
  for (size_t i = 0; i + 1 < profile.size(); ++i) {
    const Vec2 step = profile[i + 1] - profile[i];
    if (step.norm() < 1e-9) continue;
    const Vec2 normal = Vec2(step.y(), -step.x()).normalized();
    segments_.push_back({profile[i], profile[i + 1], normal, normal, total_, step.norm()});
    total_ += step.norm();
  }
  for (size_t i = 0; i + 1 < segments_.size(); ++i) {
    const Vec2 n0 = segments_[i].normal1, n1 = segments_[i + 1].normal0;
    const Vec2 face1 = Vec2(segments_[i + 1].end.y() - segments_[i + 1].begin.y(),
                            segments_[i + 1].begin.x() - segments_[i + 1].end.x())
                           .normalized();
    if (n0.dot(face1) < std::cos(40 * kPi / 180)) continue;
    segments_[i].normal1 = segments_[i + 1].normal0 = (n0 + n1).normalized();
  }
  min_height_ = profile.front().y();
  max_height_ = min_height_;
  for (const Vec2& p : profile) {
    max_radius_ = std::max(max_radius_, p.x());
    min_height_ = std::min(min_height_, p.y());
    max_height_ = std::max(max_height_, p.y());
  }
}

Vec3 Lathe::NormalAt(const Segment& segment, double s, double cosine, double sine) const {
  const Vec2 n = ((1 - s) * segment.normal0 + s * segment.normal1).normalized();
  return {n.x() * cosine, -n.y(), n.x() * sine};
}

bool Lathe::Intersect(const Ray& ray, double t_min, double t_max, Hit* hit) const {
  const Vec3 o = ray.origin - base_;
  const Vec3& d = ray.direction;
  const double oh = -o.y(), dh = -d.y();
  const double radial_a = d.x() * d.x() + d.z() * d.z();
  const double radial_b = o.x() * d.x() + o.z() * d.z();
  const double radial_c = o.x() * o.x() + o.z() * o.z();
  // Part of the ray inside the bounding cylinder's side.
  double begin = t_min, end = t_max, r0, r1;
  if (radial_a > 0) {
    if (!SolveQuadratic(radial_a, radial_b, radial_c - max_radius_ * max_radius_ * (1 + 1e-9), &r0,
                        &r1)) {
      return false;
    }
    begin = std::max(begin, r0 - 1e-9);
    end = std::min(end, r1 + 1e-9);
    if (begin > end) return false;
  }
  const double h_begin = oh + begin * dh, h_end = oh + end * dh;
  const double h_low = std::min(h_begin, h_end) - 1e-9, h_high = std::max(h_begin, h_end) + 1e-9;

  double best = t_max, best_s = 0;
  const Segment* best_segment = nullptr;
  for (const Segment& segment : segments_) {
    const double h0 = segment.begin.y(), h1 = segment.end.y();
    if (std::max(h0, h1) < h_low || std::min(h0, h1) > h_high) continue;
    if (std::abs(h1 - h0) < 1e-9) {
      if (dh == 0) continue;
      const double t = (h0 - oh) / dh;
      if (!(t > t_min && t < best)) continue;
      const double r = std::sqrt(std::max(0.0, radial_c + t * (2 * radial_b + t * radial_a)));
      const double s = (r - segment.begin.x()) / (segment.end.x() - segment.begin.x());
      if (s < 0 || s > 1) continue;
      best = t, best_s = s, best_segment = &segment;
      continue;
    }
    const double k = (segment.end.x() - segment.begin.x()) / (h1 - h0);
    const double r_at_o = segment.begin.x() + k * (oh - h0), dr = k * dh;
    double roots[2];
    const double a = radial_a - dr * dr;
    if (std::abs(a) < 1e-14 || !SolveQuadratic(a, radial_b - r_at_o * dr,
                                               radial_c - r_at_o * r_at_o, &roots[0], &roots[1])) {
      continue;
    }
    for (const double t : roots) {
      if (!(t > t_min && t < best)) continue;
      const double s = (oh + t * dh - h0) / (h1 - h0);
      if (s < 0 || s > 1 || r_at_o + t * dr < 0) continue;
      best = t, best_s = s, best_segment = &segment;
    }
  }
  if (!best_segment) return false;
  const Vec3 p = o + best * d;
  const double r = std::max(1e-12, std::sqrt(p.x() * p.x() + p.z() * p.z()));
  hit->t = best;
  hit->chart = 0;
  hit->uv = {AngleFraction(p.z(), p.x()),
             (best_segment->offset + best_s * best_segment->length) / total_};
  hit->normal = NormalAt(*best_segment, best_s, p.x() / r, p.z() / r);
  const Vec2 step = best_segment->end - best_segment->begin;
  hit->face = Vec3(step.y() * p.x() / r, step.x(), step.y() * p.z() / r) / best_segment->length;
  return true;
}

Surfel Lathe::At(int, const Vec2& uv) const {
  const double along = std::clamp(uv.y(), 0.0, 1.0) * total_;
  auto it = std::upper_bound(segments_.begin(), segments_.end(), along,
                             [](double value, const Segment& s) { return value < s.offset; });
  const Segment& segment = it == segments_.begin() ? segments_.front() : *(it - 1);
  const double s = std::clamp((along - segment.offset) / segment.length, 0.0, 1.0);
  const Vec2 p = segment.begin + s * (segment.end - segment.begin);
  const double cosine = std::cos(2 * kPi * uv.x()), sine = std::sin(2 * kPi * uv.x());
  return {base_ + Vec3(p.x() * cosine, -p.y(), p.x() * sine), NormalAt(segment, s, cosine, sine)};
}

bool Lathe::Contains(const Vec3& point, double margin) const {
  const double r = std::hypot(point.x() - base_.x(), point.z() - base_.z());
  const double h = base_.y() - point.y();
  if (r > max_radius_ || h < min_height_ || h > max_height_) return false;
  // Crossings towards larger radii decide; then the distance to the profile.
  bool inside = false;
  double nearest = std::numeric_limits<double>::infinity();
  for (const Segment& s : segments_) {
    const Vec2 step = s.end - s.begin;
    if ((s.begin.y() > h) != (s.end.y() > h) &&
        s.begin.x() + (h - s.begin.y()) / step.y() * step.x() > r) {
      inside = !inside;
    }
    const double along =
        std::clamp((Vec2(r, h) - s.begin).dot(step) / step.squaredNorm(), 0.0, 1.0);
    nearest = std::min(nearest, (Vec2(r, h) - s.begin - along * step).norm());
  }
  return inside && nearest > margin;
}

std::vector<Vec2> Lathe::ChartSizes() const { return {{2 * kPi * max_radius_, total_}}; }

Eigen::AlignedBox3d Lathe::Bounds() const {
  return {base_ + Vec3(-max_radius_, -max_height_, -max_radius_),
          base_ + Vec3(max_radius_, -min_height_, max_radius_)};
}

// ---- Capsule ----

Capsule::Capsule(const Vec3& a, const Vec3& b, double radius)
    : a_(a), axis_((b - a).normalized()), length_((b - a).norm()), radius_(radius) {
  side_ = axis_.unitOrthogonal();
  up_ = axis_.cross(side_);
}

bool Capsule::Intersect(const Ray& ray, double t_min, double t_max, Hit* hit) const {
  const Vec3 o = ray.origin - a_;
  const Vec3& d = ray.direction;
  const double oa = o.dot(axis_), da = d.dot(axis_);
  const Vec3 op = o - oa * axis_, dp = d - da * axis_;
  double best = t_max, t0, t1;
  if (SolveQuadratic(dp.squaredNorm(), op.dot(dp), op.squaredNorm() - radius_ * radius_, &t0,
                     &t1)) {
    for (const double t : {t0, t1}) {
      const double along = oa + t * da;
      if (t > t_min && t < best && along >= 0 && along <= length_) best = t;
    }
  } else if (dp.squaredNorm() > 0) {
    return false;
  }
  for (const double end : {0.0, length_}) {
    const Vec3 oc = o - end * axis_;
    if (!SolveQuadratic(d.squaredNorm(), oc.dot(d), oc.squaredNorm() - radius_ * radius_, &t0,
                        &t1)) {
      continue;
    }
    for (const double t : {t0, t1}) {
      const double along = oa + t * da;
      if (t > t_min && t < best && (end == 0 ? along < 0 : along > length_)) best = t;
    }
  }
  if (!(best < t_max)) return false;
  const Vec3 p = o + best * d;
  const double along = std::clamp(p.dot(axis_), 0.0, length_);
  hit->t = best;
  hit->chart = 0;
  hit->normal = hit->face = (p - along * axis_) / radius_;
  hit->uv = {AngleFraction(hit->normal.dot(up_), hit->normal.dot(side_)), along / length_};
  return true;
}

Surfel Capsule::At(int, const Vec2& uv) const {
  const double phi = 2 * kPi * uv.x();
  const Vec3 n = std::cos(phi) * side_ + std::sin(phi) * up_;
  return {a_ + uv.y() * length_ * axis_ + radius_ * n, n};
}

bool Capsule::Contains(const Vec3& point, double margin) const {
  const Vec3 p = point - a_;
  const double along = std::clamp(p.dot(axis_), 0.0, length_);
  return (p - along * axis_).norm() < radius_ - margin;
}

std::optional<Strand> Capsule::StrandAt(const Vec3& point) const {
  const double along = std::clamp(axis_.dot(point - a_), 0.0, length_);
  return Strand{a_ + along * axis_, axis_, radius_};
}

std::vector<Vec2> Capsule::ChartSizes() const { return {{2 * kPi * radius_, length_}}; }

Eigen::AlignedBox3d Capsule::Bounds() const {
  Eigen::AlignedBox3d box(a_);
  box.extend(Vec3(a_ + length_ * axis_));
  return {box.min() - Vec3::Constant(radius_), box.max() + Vec3::Constant(radius_)};
}

// ---- Leaf ----

Leaf::Leaf(const Vec3& base, const Vec3& along, const Vec3& up, const Form& form)
    : base_(base), form_(form) {
  const Vec3 x = along.normalized();
  const Vec3 y = up.cross(x).normalized();
  world_from_local_.col(0) = x;
  world_from_local_.col(1) = y;
  world_from_local_.col(2) = x.cross(y);
}

double Leaf::HalfWidth(double u) const {
  if (u <= 0 || u >= 1) return 0;
  return 0.5 * form_.width * std::pow(std::sin(kPi * std::pow(u, 0.8)), form_.tip);
}

double Leaf::Drop() const {
  const double half = form_.length / 2;
  return std::sqrt(form_.bend * form_.bend - form_.fold * form_.fold - half * half);
}

bool Leaf::Intersect(const Ray& ray, double t_min, double t_max, Hit* hit) const {
  const Vec3 o = world_from_local_.transpose() * (ray.origin - base_);
  const Vec3 d = world_from_local_.transpose() * ray.direction;
  const double r2 = form_.bend * form_.bend;
  const double drop = Drop();
  double best = t_max;
  Vec3 best_normal = Vec3::Zero();
  Vec2 best_uv = Vec2::Zero();
  for (const double side : {-1.0, 1.0}) {
    const Vec3 oc = o - Vec3(form_.length / 2, side * form_.fold, -drop);
    double roots[2];
    if (!SolveQuadratic(d.squaredNorm(), oc.dot(d), oc.squaredNorm() - r2, &roots[0], &roots[1])) {
      continue;
    }
    for (const double t : roots) {
      if (!(t > t_min && t < best)) continue;
      const Vec3 p = o + t * d, n = (oc + t * d) / form_.bend;
      if (n.z() <= 0 || p.y() * side < 0) continue;
      if (std::abs(p.y()) > HalfWidth(p.x() / form_.length)) continue;
      best = t;
      best_normal = n;
      best_uv = {p.x() / form_.length, 0.5 + p.y() / form_.width};
    }
  }
  if (!(best < t_max)) return false;
  const bool upper = best_normal.dot(d) < 0;
  hit->t = best;
  hit->chart = upper ? 0 : 1;
  hit->uv = best_uv;
  hit->normal = hit->face = world_from_local_ * (upper ? best_normal : Vec3(-best_normal));
  return true;
}

Surfel Leaf::At(int chart, const Vec2& uv) const {
  const double y = (uv.y() - 0.5) * form_.width;
  const double side = y < 0 ? -1 : 1;
  const double drop = Drop();
  Vec3 n((uv.x() - 0.5) * form_.length, y - side * form_.fold, 0);
  n.z() = std::sqrt(std::max(1e-12, form_.bend * form_.bend - n.squaredNorm()));
  const Vec3 p = n + Vec3(form_.length / 2, side * form_.fold, -drop);
  return {base_ + world_from_local_ * p,
          world_from_local_ * (n.normalized() * (chart == 0 ? 1.0 : -1.0))};
}

std::vector<Vec2> Leaf::ChartSizes() const {
  return {{form_.length, form_.width}, {form_.length, form_.width}};
}

Eigen::AlignedBox3d Leaf::Bounds() const {
  Eigen::AlignedBox3d box;
  constexpr int kSteps = 12;
  for (int i = 0; i <= kSteps; ++i) {
    for (int j = 0; j <= kSteps; ++j) {
      box.extend(At(0, {double(i) / kSteps, double(j) / kSteps}).point);
    }
  }
  const Vec3 slack = Vec3::Constant(0.02 * form_.length);
  return {box.min() - slack, box.max() + slack};
}

}  // namespace retint::synthetic
