// SPDX-License-Identifier: BSD-3-Clause
#include "selection/views_between.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <queue>

#include "kernels/common/types.h"
#include "scene/look_along.h"

namespace retint {
namespace {

using Eigen::Vector3d;

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kNarrow = 15 * kDegree + 1e-9;  // a narrower gap needs no view; with rounding
constexpr double kOpen = 180 * kDegree;          // nobody looked from the side of a wider gap
constexpr double kUpright = 0.3;                 // least length of the mean vertical

// A camera's direction and distance from the middle.
struct Place {
  double around, height;  // angles
  double log_distance;
};

struct Gap {
  Place from, to;
  int parts = 1;
  double Width() const { return to.around - from.around; }
  bool operator<(const Gap& other) const {
    return Width() / parts < other.Width() / other.parts ||
           (Width() / parts == other.Width() / other.parts && from.around > other.from.around);
  }
};

// Directions around a vertical.
struct Compass {
  Vector3d up, east, north;
  explicit Compass(const Vector3d& vertical)
      : up(vertical), east(vertical.unitOrthogonal()), north(vertical.cross(east)) {}

  Place PlaceOf(const Vector3d& offset) const {
    const double distance = offset.norm();
    return {std::atan2(offset.dot(north), offset.dot(east)),
            std::asin(std::clamp(offset.dot(up) / distance, -1.0, 1.0)), std::log(distance)};
  }
  Vector3d Offset(const Place& place) const {
    const Vector3d flat = std::cos(place.around) * east + std::sin(place.around) * north;
    return std::exp(place.log_distance) *
           (std::cos(place.height) * flat + std::sin(place.height) * up);
  }
};

std::vector<Gap> GapsBetween(std::vector<Place> places) {
  std::sort(places.begin(), places.end(),
            [](const Place& a, const Place& b) { return a.around < b.around; });
  std::vector<Gap> gaps;
  for (size_t i = 0; i < places.size(); ++i) {
    Place to = places[(i + 1) % places.size()];
    if (i + 1 == places.size()) to.around += 2 * std::numbers::pi;
    const Gap gap{places[i], to};
    if (gap.Width() > kNarrow && gap.Width() <= kOpen) gaps.push_back(gap);
  }
  return gaps;
}

}  // namespace

std::vector<PosedCamera> ViewsBetween(const std::vector<PosedCamera>& cameras,
                                      const Vector3d& middle, const Camera& lens, size_t count) {
  std::vector<const PosedCamera*> counting;
  Vector3d vertical = Vector3d::Zero();
  for (const PosedCamera& camera : cameras) {
    if (!((camera.cam_from_world * middle).z() > double(kNearPlane))) continue;
    counting.push_back(&camera);
    vertical -= camera.cam_from_world.rotation.conjugate() * Vector3d::UnitY();
  }
  if (counting.size() < 2 || vertical.norm() < kUpright * double(counting.size())) return {};
  const Compass compass(vertical.normalized());
  std::vector<Place> places;
  for (const PosedCamera* camera : counting) {
    places.push_back(compass.PlaceOf(camera->Center() - middle));
  }
  const std::vector<Gap> found = GapsBetween(std::move(places));
  std::priority_queue<Gap> gaps(found.begin(), found.end());
  for (size_t i = 0; i < count && !gaps.empty(); ++i) {
    Gap gap = gaps.top();
    if (gap.Width() / gap.parts <= kNarrow) break;
    gaps.pop();
    ++gap.parts;
    gaps.push(gap);
  }
  std::vector<PosedCamera> views;
  for (; !gaps.empty(); gaps.pop()) {
    const Gap& gap = gaps.top();
    for (int part = 1; part < gap.parts; ++part) {
      const double t = double(part) / gap.parts;
      const Vector3d offset =
          compass.Offset({std::lerp(gap.from.around, gap.to.around, t),
                          std::lerp(gap.from.height, gap.to.height, t),
                          std::lerp(gap.from.log_distance, gap.to.log_distance, t)});
      views.push_back({lens, LookAlong(middle + offset, -offset, compass.up)});
    }
  }
  return views;
}

}  // namespace retint
