// SPDX-License-Identifier: BSD-3-Clause
#include "synthetic/discs.h"

#include <cmath>
#include <limits>
#include <numbers>

#include "base/parallel.h"
#include "kernels/common/types.h"
#include "synthetic/noise.h"

namespace retint::synthetic {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kReach = 1.3;  // standard deviations of a disc that must lie on the surface
// Pixels by which discs of solids are sunk: a render widens every outline by about as much.
constexpr double kSink = 0.5;
constexpr double kRodStretch = 1.35;  // of beads along their rod, which smooths it
constexpr double kRodSigma = 0.68;    // of beads on rods, in the rod's radius

constexpr int kRounds = 4;
constexpr double kOpaque =
    1.42;  // standard deviations within which a disc hides the things behind it
constexpr double kStep = 0.25;  // pixels, of the walk to the outline
constexpr double kLeastForeshortening = 0.4;
constexpr double kLeastSigma = 0.2;   // pixels
constexpr double kLeastShare = 0.75;  // of a disc's size, in a round and in all
constexpr double kDamping = 0.8;
// How far a disc may move: along its surface in its size, across it in pixels. Further, and
// neighbors would part.
constexpr double kMostAlong = 0.5, kMostAcrossSolid = 1, kMostAcrossSheet = 0.5;
constexpr double kFillerDepth = 1.5;  // pixels below the surface
constexpr double kFarther = 1.002;    // relative depth at which a neighbor counts as behind

PixelArray<uint8_t, 1> DistanceToOutlines(const PixelArray<uint8_t, 1>& ids) {
  const int width = ids.width, height = ids.height;
  PixelArray<uint8_t, 1> distance(width, height, 255);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (const auto& [dx, dy] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}}) {
        if (ids.Contains(x + dx, y + dy) && ids(x + dx, y + dy) != ids(x, y)) distance(x, y) = 0;
      }
    }
  }
  // Two passes, each over the neighbors already visited.
  const auto pass = [&](int x, int y, int sign) {
    int best = distance(x, y);
    for (const auto& [dx, dy] : {std::pair{-1, 0}, {-1, -1}, {0, -1}, {1, -1}}) {
      const int nx = x + sign * dx, ny = y + sign * dy;
      if (distance.Contains(nx, ny)) best = std::min(best, distance(nx, ny) + 1);
    }
    distance(x, y) = uint8_t(best);
  };
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) pass(x, y, 1);
  }
  for (int y = height; y-- > 0;) {
    for (int x = width; x-- > 0;) pass(x, y, -1);
  }
  return distance;
}

// The part's surface under a point offset in the tangent plane.
std::optional<Hit> Probe(const World& world, const Disc& disc, const Vec3& offset, Vec3* where) {
  const double height = 0.7 * offset.norm() + 1e-4;
  const Ray ray = {disc.point + offset + height * disc.normal, -disc.normal};
  Hit hit;
  if (!world.parts[size_t(disc.part)].shape->Intersect(ray, 0, 2 * height, &hit)) return {};
  if (hit.normal.dot(disc.normal) <= 0.5) return {};
  hit.shape = disc.part;
  *where = ray.At(hit.t);
  return hit;
}

// Fits a disc to where its surface ends.
void Trim(const World& world, Disc* disc) {
  Vec3 where;
  const auto on_surface = [&](const Vec3& offset) {
    return Probe(world, *disc, offset, &where).has_value();
  };
  const double sigma = disc->wanted, reach = kReach * sigma;
  // Directions in which the surface ends, as an axis: ends on opposite sides add up.
  Vec2 doubled = Vec2::Zero();
  const Vec3 first = disc->axis, second = disc->Across();
  bool edge = false;
  for (int k = 0; k < 8; ++k) {
    const double phi = k * kPi / 4;
    if (on_surface(reach * (std::cos(phi) * first + std::sin(phi) * second))) continue;
    doubled += Vec2(std::cos(2 * phi), std::sin(2 * phi));
    edge = true;
  }
  if (!edge) return;
  if (doubled.norm() > 1e-3) {
    const double phi = 0.5 * std::atan2(doubled.y(), doubled.x());
    disc->axis = std::cos(phi) * first + std::sin(phi) * second;
  }
  Vec3 shift = Vec3::Zero();
  for (int axis = 0; axis < 2; ++axis) {
    const Vec3 direction = axis == 0 ? disc->axis : disc->Across();
    double extent[2];
    for (int side = 0; side < 2; ++side) {
      double inside = 0, outside = reach;
      const Vec3 outward = side == 0 ? direction : Vec3(-direction);
      if (on_surface(reach * outward)) inside = reach;
      for (int step = 0; step < 4 && inside < reach; ++step) {
        const double middle = 0.5 * (inside + outside);
        (on_surface(middle * outward) ? inside : outside) = middle;
      }
      extent[side] = inside;
    }
    disc->sigma[axis] = std::max(0.4 * sigma, 0.5 * (extent[0] + extent[1]) / kReach);
    shift += 0.5 * (extent[0] - extent[1]) * direction;
  }
  if (const auto hit = Probe(world, *disc, shift, &where)) {
    disc->point = disc->surface = where;
    disc->hit = *hit;
    disc->axis = (disc->axis - hit->normal.dot(disc->axis) * hit->normal).normalized();
    disc->normal = hit->normal;
  }
}

}  // namespace

std::optional<Disc> MakeDisc(const World& world, const std::vector<TracedView>& views,
                             const Seed& seed, int part) {
  const TracedView& view = views[seed.view];
  const auto width = uint32_t(view.parts.width);
  const Ray ray = PixelRay(view.camera, seed.pixel % width + 0.5, seed.pixel / width + 0.5);
  const Shape& shape = *world.parts[size_t(part)].shape;
  Disc disc;
  if (!shape.Intersect(ray, 1e-6, 1e3, &disc.hit)) return std::nullopt;
  disc.part = disc.hit.shape = part;
  disc.point = disc.surface = ray.At(disc.hit.t);
  disc.normal = disc.hit.normal;
  disc.axis = disc.normal.unitOrthogonal();
  // In flat color, overlap costs nothing and closes the gaps.
  disc.wanted = seed.radius * (0.85 + 0.40 * Smooth(1.2, 3, seed.pixels));
  disc.sigma[0] = disc.sigma[1] = disc.wanted;
  disc.pixel = seed.radius / seed.pixels;
  if (const auto strand = shape.StrandAt(disc.point)) {
    disc.point = strand->point;
    disc.axis = strand->direction;
    disc.normal = (disc.normal - disc.axis.dot(disc.normal) * disc.axis).normalized();
    disc.sigma[0] *= kRodStretch;
    disc.sigma[1] = kRodSigma * strand->radius;
    disc.rod = strand->radius;
    return disc;
  }
  Trim(world, &disc);
  const Vec3 sunk = disc.point - kSink * seed.radius / seed.pixels * disc.normal;
  disc.solid = shape.Contains(sunk);
  if (disc.solid) disc.point = sunk;
  return disc;
}

std::optional<Disc> MakeFiller(const World& world, const Disc& disc) {
  if (disc.rod > 0 || world.ObjectOf(disc.part).furniture) return std::nullopt;
  const Vec3 moved = disc.point - disc.surface;
  const double along = moved.dot(disc.normal);
  const bool trimmed = std::min(disc.sigma[0], disc.sigma[1]) < 0.8 * disc.wanted ||
                       (moved - along * disc.normal).norm() > 0.3 * disc.wanted;
  if (!trimmed) return std::nullopt;
  Disc filler = disc;
  filler.filler = true;
  filler.point = disc.surface - kFillerDepth * disc.pixel * disc.normal;
  filler.sigma[0] = filler.sigma[1] = disc.wanted;
  if (!world.parts[size_t(disc.part)].shape->Contains(filler.point)) return std::nullopt;
  return filler;
}

// A view in front of which a disc lies: pixels a meter along its three axes.
struct Silhouettes::Sight {
  size_t view;
  Vec2 scale[3];
  double per_meter;  // pixels, of discs parallel to the image
};

Silhouettes::Silhouettes(const World& world, const std::vector<TracedView>& views)
    : world_(world), views_(views), distances_(views.size()) {
  ParallelTasks(int64_t(views.size()),
                [&](size_t v) { distances_[v] = DistanceToOutlines(views[v].truth.object_ids); });
}

std::vector<Silhouettes::Sight> Silhouettes::Sights(const Disc& disc, const Vec3 (&axes)[3]) const {
  std::vector<Sight> sights;
  const double largest = std::max(disc.sigma[0], disc.sigma[1]);
  for (size_t v = 0; v < views_.size(); ++v) {
    const TracedView& view = views_[v];
    const Vec3 p = view.camera.cam_from_world * disc.point;
    const auto at = view.camera.Project(disc.point);
    if (!at) continue;
    const int x = int(std::floor(at->x())), y = int(std::floor(at->y()));
    if (!view.parts.Contains(x, y)) continue;
    Sight sight{v, {}, view.camera.camera.fx() / p.z()};
    if (distances_[v](x, y) > 2 + 2 * kOpaque * (1 + largest * sight.per_meter)) continue;
    for (int k = 0; k < 3; ++k) {
      const Vec3 a = view.camera.cam_from_world.rotation * axes[k];
      sight.scale[k] = sight.per_meter * (a.head<2>() - a.z() / p.z() * p.head<2>());
    }
    sights.push_back(sight);
  }
  return sights;
}

std::array<double, 2> Silhouettes::Walk(const Sight& sight, const Vec2& at, int axis, double z,
                                        int object, double reach) const {
  const TracedView& view = views_[sight.view];
  const double per_meter = sight.scale[axis].norm();
  std::array<double, 2> room = {reach, reach};
  enum { kOwn, kBehind, kHiding };
  int clear = 0;  // pixels to the next outline
  const auto look = [&](const Vec2& p) {
    const int x = int(std::floor(p.x())), y = int(std::floor(p.y()));
    if (!view.parts.Contains(x, y)) return kHiding;
    clear = distances_[sight.view](x, y);
    if (view.truth.object_ids(x, y) == object) return kOwn;
    const double depth = view.truth.depth(x, y);
    return depth > 0 && depth < kFarther * z ? kHiding : kBehind;
  };
  const auto start = look(at);
  if (start == kHiding) return room;
  double first[2] = {-1, -1};  // meters to the first change, or -1
  for (int side = 0; side < 2; ++side) {
    const Vec2 step = (side == 0 ? 1 : -1) / per_meter * sight.scale[axis];
    for (double walked = 0; walked <= reach * per_meter; walked += std::max(kStep, clear - 1.0)) {
      const auto now = look(at + walked * step);
      if (now == start) continue;
      if (now != kHiding) first[side] = std::max(0.0, walked - 0.5 * kStep) / per_meter;
      break;
    }
  }
  // From outside, back to the nearer side, if there is one.
  const int back = first[0] >= 0 && (first[1] < 0 || first[0] <= first[1]) ? 0 : 1;
  for (int side = 0; side < 2; ++side) {
    if (start == kOwn && first[side] >= 0) room[side] = first[side];
    if (start == kBehind && side == back && first[side] >= 0) room[1 - side] = -first[side];
  }
  return room;
}

// The limits of the views for a disc along one axis.
struct Silhouettes::Demand {
  double lack[2] = {0, 0};  // meters that the room is short of, forwards and backwards
  double fitting;           // the largest standard deviation that fits between two outlines
};

Silhouettes::Demand Silhouettes::Ask(const std::vector<Sight>& sights, const Disc& disc, int axis,
                                     int object) const {
  const double sigma = axis < 2 ? disc.sigma[axis] : disc.Thickness();
  Demand demand;
  demand.fitting = sigma;
  for (const Sight& sight : sights) {
    const double per_meter = sight.scale[axis].norm();
    if (per_meter < kLeastForeshortening * sight.per_meter) continue;
    const auto at = views_[sight.view].camera.Project(disc.point);
    if (!at) continue;
    const double blur2 = kCovarianceDilation / (per_meter * per_meter);
    const double reach = kOpaque * std::sqrt(sigma * sigma + blur2);
    const auto room = Walk(sight, at->head<2>(), axis, at->z(), object, reach);
    for (int side = 0; side < 2; ++side) {
      demand.lack[side] = std::max(demand.lack[side], reach - room[side]);
    }
    if (room[0] < reach && room[1] < reach) {
      const double half = 0.5 * (room[0] + room[1]) / kOpaque;
      const double least = kLeastSigma / sight.per_meter;
      demand.fitting =
          std::min(demand.fitting, std::sqrt(std::max(least * least, half * half - blur2)));
    }
  }
  return demand;
}

bool Silhouettes::Hides(const Disc& disc) const {
  const Vec3 long_way = kOpaque * disc.sigma[0] * disc.axis;
  const Vec3 short_way = kOpaque * disc.sigma[1] * disc.Across();
  const Vec3 points[] = {disc.point, disc.point + long_way, disc.point - long_way,
                         disc.point + short_way, disc.point - short_way};
  const auto seen = [&](const TracedView& view, const Vec3& point) {
    const auto at = view.camera.Project(point);
    if (!at) return false;
    const int x = int(std::floor(at->x())), y = int(std::floor(at->y()));
    if (!view.parts.Contains(x, y)) return false;
    return view.truth.depth(x, y) == 0 || view.truth.depth(x, y) > at->z() - 0.5 * disc.pixel;
  };
  return std::none_of(views_.begin(), views_.end(), [&](const TracedView& view) {
    return std::any_of(std::begin(points), std::end(points),
                       [&](const Vec3& point) { return seen(view, point); });
  });
}

void Silhouettes::KeepInside(Disc* disc) const {
  // Furniture meets other furniture all along its outlines: gaps there would show.
  if (world_.ObjectOf(disc->part).furniture) return;
  const int object = world_.parts[size_t(disc->part)].object;
  const Vec3 axes[3] = {disc->axis, disc->Across(), disc->normal};
  const auto sights = Sights(*disc, axes);
  // Discs side by side must go on covering their surface; across a rod there is only one.
  const double least[2] = {kLeastShare * disc->sigma[0],
                           disc->rod > 0 ? 0 : kLeastShare * disc->sigma[1]};
  const Vec3 start = disc->point;
  const auto limit = [&](int axis) {
    if (disc->rod > 0 || disc->filler) return std::numeric_limits<double>::infinity();
    if (axis < 2) return kMostAlong * disc->wanted;
    return (disc->solid ? kMostAcrossSolid : kMostAcrossSheet) * disc->pixel;
  };
  for (int round = 0; round < kRounds; ++round) {
    bool moved = false;
    for (int k = 0; k < 3; ++k) {
      const Demand demand = Ask(sights, *disc, k, object);
      const double* lack = demand.lack;
      if (lack[0] == 0 && lack[1] == 0) continue;
      const bool both = lack[0] > 0 && lack[1] > 0;
      disc->point += kDamping * (both ? 0.5 : 1.0) * (lack[1] - lack[0]) * axes[k];
      if (k < 2) {
        double& sigma = disc->sigma[k];
        sigma = std::min(sigma, std::max({demand.fitting, kLeastShare * sigma, least[k]}));
      }
      const double along = (disc->point - start).dot(axes[k]);
      disc->point += (std::clamp(along, -limit(k), limit(k)) - along) * axes[k];
      moved = true;
    }
    if (!moved) return;
  }
}

}  // namespace retint::synthetic
