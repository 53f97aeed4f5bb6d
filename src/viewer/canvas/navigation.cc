// SPDX-License-Identifier: BSD-3-Clause
#include "viewer/canvas/navigation.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

#include "base/median.h"
#include "scene/camera_projection.h"
#include "scene/undistortion.h"

namespace retint {
namespace {

constexpr double kSteepest = 0.995;     // sine of the highest pitch
constexpr double kFlat = 0.02;          // sine of the angle to up below which there is no horizon
constexpr double kTurnPerHeight = 3.0;  // radians a drag over the viewport's height turns
constexpr double kZoomPerNotch = 0.12;  // of the logarithm of the distance
constexpr double kFlyPerSecond = 0.5;   // of the scene's radius
constexpr double kLevelPerHeight = 4;   // of the tilt's logarithm, a drag over the height
constexpr double kOwnUp = 0.002;        // weight of the views' own up beside their right axes

Eigen::Vector3d MedianPoint(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d median = Eigen::Vector3d::Zero();
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    values.reserve(points.size());
    for (const auto& point : points) values.push_back(point[axis]);
    median[axis] = Median(std::move(values));
  }
  return median;
}

// Rows of the rotation: the camera's axes in the world.
Eigen::Vector3d Axis(const Rigid3d& cam_from_world, int index) {
  return cam_from_world.rotation.toRotationMatrix().row(index).transpose();
}

// The unit vector u that minimizes the mean of (u . r)^2 + kOwnUp |u - m|^2. Here r are the views'
// right axes, and m is the mean of their ups: (mean(r r^T) + kOwnUp) u ~ m.
Eigen::Vector3d UpOf(const std::vector<const View*>& views) {
  Eigen::Matrix3d rights = Eigen::Matrix3d::Zero();
  Eigen::Vector3d own = Eigen::Vector3d::Zero();
  for (const View* view : views) {
    const Eigen::Vector3d right = Axis(view->cam_from_world, 0);
    rights += right * right.transpose() / double(views.size());
    own -= Axis(view->cam_from_world, 1);
  }
  if (!(own.norm() > 1e-6)) return {0, -1, 0};
  const Eigen::Matrix3d weights = rights + kOwnUp * Eigen::Matrix3d::Identity();
  return weights.ldlt().solve(own).normalized();
}

// The point that the views look at: nearest, in the least squares sense, to all their axes.
Eigen::Vector3d LookedAt(const Reconstruction& reconstruction) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const auto& [id, view] : reconstruction.views) {
    const Eigen::Vector3d axis = Axis(view.cam_from_world, 2);
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - axis * axis.transpose();
    sum += across;
    right += across * view.cam_from_world.OriginInSource();
  }
  const double views = static_cast<double>(std::max<size_t>(1, reconstruction.views.size()));
  return (sum + 1e-6 * views * Eigen::Matrix3d::Identity()).ldlt().solve(right);
}

}  // namespace

void Navigation::SetScene(const Reconstruction& reconstruction) {
  const auto views = reconstruction.ViewsByName();
  up_ = UpOf(views);
  std::vector<Eigen::Vector3d> points;
  for (const auto& [id, point] : reconstruction.points) points.push_back(point.xyz);
  center_ = points.size() >= 8 ? MedianPoint(points) : LookedAt(reconstruction);
  std::vector<double> distances;
  for (const auto& point : points) distances.push_back((point - center_).norm());
  radius_ = Median(std::move(distances));
  if (!(radius_ > 0) && !views.empty()) {
    radius_ = 0.5 * (views.front()->cam_from_world.OriginInSource() - center_).norm();
  }
  if (!(radius_ > 0)) radius_ = 1;
  home_ = view_ = nullptr;
  if (!views.empty()) SetHome(*views.front(), reconstruction.Posed(*views.front()));
}

void Navigation::SetHome(const View& view, const PosedCamera& posed) {
  GoTo(view, posed);
  home_ = &view;
  home_posed_ = posed;
}

void Navigation::SetViewport(int width, int height) {
  width_ = std::max(1, width);
  height_ = std::max(1, height);
}

double Navigation::FocalPixels() const { return 0.5 * height_ / tan_half_fov_; }

PosedCamera Navigation::Rendered() const {
  if (!view_) {
    const double focal = FocalPixels();
    return {Camera::Pinhole(0, width_, height_, focal, focal, 0.5 * width_, 0.5 * height_),
            cam_from_world_};
  }
  const Camera& camera = posed_.camera;
  const double scale = std::min(double(width_) / camera.width, double(height_) / camera.height);
  const int width = std::clamp(int(std::lround(camera.width * scale)), 1, width_);
  const int height = std::clamp(int(std::lround(camera.height * scale)), 1, height_);
  return {Resized(camera, width, height), posed_.cam_from_world};
}

PosedCamera Navigation::Exact() const { return view_ ? posed_ : Rendered(); }

void Navigation::GoTo(const View& view, const PosedCamera& posed) {
  view_ = &view;
  posed_ = posed;
  cam_from_world_ = posed.cam_from_world;
  // The focus: on the view's axis, as far as the scene's center.
  const double depth = (cam_from_world_ * center_).z();
  focus_ = cam_from_world_.Inverse() * Eigen::Vector3d(0, 0, std::max(depth, 0.2 * radius_));
}

void Navigation::SetFree(const PosedCamera& camera, const Eigen::Vector3d& focus) {
  view_ = nullptr;
  cam_from_world_ = camera.cam_from_world;
  tan_half_fov_ = 0.5 * camera.camera.height / camera.camera.fy();
  focus_ = focus;
}

// The free camera takes over where the view was, at the same scale on the screen. Of a photo that
// no single pinhole view shows, that would be too wide: then it is 90 degrees, the longer way.
void Navigation::Leave() {
  if (!view_) return;
  const PosedCamera shown = Rendered();
  view_ = nullptr;
  tan_half_fov_ = 0.5 * height_ / Flattened(shown.camera).fy();
  if (!shown.camera.IsPinhole() && Undistort(posed_.camera).faces.size() > 1) {
    tan_half_fov_ = std::min(tan_half_fov_, double(height_) / std::max(width_, height_));
  }
}

void Navigation::RotateAbout(const Eigen::Vector3d& point,
                             const Eigen::Quaterniond& world_rotation) {
  const Eigen::Vector3d origin = cam_from_world_.OriginInSource();
  const Eigen::Vector3d moved = point + world_rotation * (origin - point);
  cam_from_world_.rotation = (cam_from_world_.rotation * world_rotation.conjugate()).normalized();
  cam_from_world_.translation = -(cam_from_world_.rotation * moved);
}

void Navigation::Turn(const Eigen::Vector3d& about, double yaw, double pitch) {
  RotateAbout(about, Eigen::Quaterniond(Eigen::AngleAxisd(yaw, up_)));
  // About the level right axis, so that the horizon's tilt stays as it is. The pitch stops before
  // the poles, but never where a view already is beyond them.
  const Eigen::Vector3d forward = Axis(cam_from_world_, 2);
  const Eigen::Vector3d level = forward.cross(up_);
  const Eigen::Vector3d right =
      level.norm() > kFlat ? level.normalized() : Axis(cam_from_world_, 0);
  const Eigen::Quaterniond tilt(Eigen::AngleAxisd(pitch, right));
  const double now = std::abs(forward.dot(up_)), then = std::abs((tilt * forward).dot(up_));
  if (then > kSteepest && then > now) return;
  RotateAbout(about, tilt);
}

void Navigation::Level(const Eigen::Vector3d& about, double share) {
  const Eigen::Vector3d forward = Axis(cam_from_world_, 2), level = forward.cross(up_);
  if (level.norm() <= kFlat) return;  // looking along up there is no horizon
  const Eigen::Vector3d right = Axis(cam_from_world_, 0);
  const double tilt = std::atan2(right.cross(level).dot(forward), right.dot(level));
  RotateAbout(about, Eigen::Quaterniond(Eigen::AngleAxisd(share * tilt, forward)));
}

void Navigation::Orbit(double dx, double dy) {
  Leave();
  const double turn = kTurnPerHeight / height_;
  Turn(focus_, -dx * turn, -dy * turn);
  Level(focus_, 1 - std::exp(-kLevelPerHeight * std::hypot(dx, dy) / height_));
}

void Navigation::Look(double dx, double dy) {
  Leave();
  const double distance = (focus_ - cam_from_world_.OriginInSource()).norm();
  // The point under the cursor stays under it.
  Turn(cam_from_world_.OriginInSource(), dx / FocalPixels(), dy / FocalPixels());
  Level(cam_from_world_.OriginInSource(),
        1 - std::exp(-kLevelPerHeight * std::hypot(dx, dy) / height_));
  focus_ = cam_from_world_.Inverse() * Eigen::Vector3d(0, 0, distance);
}

void Navigation::Pan(double dx, double dy) {
  Leave();
  const double depth = std::max((cam_from_world_ * focus_).z(), 1e-3 * radius_);
  const Eigen::Vector3d step(dx * depth / FocalPixels(), dy * depth / FocalPixels(), 0);
  cam_from_world_.translation += step;
  focus_ -= cam_from_world_.rotation.conjugate() * step;
}

void Navigation::Zoom(double steps) {
  Leave();
  const Eigen::Vector3d origin = cam_from_world_.OriginInSource();
  const Eigen::Vector3d offset = origin - focus_;
  const double old_distance = std::max(offset.norm(), 1e-9);
  const double distance =
      std::clamp(old_distance * std::exp(-kZoomPerNotch * steps), 1e-3 * radius_, 1e3 * radius_);
  const Eigen::Vector3d moved = focus_ + offset * (distance / old_distance);
  cam_from_world_.translation = -(cam_from_world_.rotation * moved);
}

void Navigation::Fly(const Eigen::Vector3d& direction, double seconds, double factor) {
  Leave();
  const Eigen::Vector3d step = direction * (kFlyPerSecond * radius_ * seconds * factor);
  cam_from_world_.translation -= step;
  focus_ += cam_from_world_.rotation.conjugate() * step;
}

void Navigation::SetFocus(const Eigen::Vector3d& focus) {
  Leave();
  focus_ = focus;
  const Eigen::Vector3d seen = cam_from_world_ * focus;
  if (!(seen.norm() > 0)) return;
  // The shortest rotation that brings it to the axis.
  const Eigen::Quaterniond turn =
      Eigen::Quaterniond::FromTwoVectors(seen, Eigen::Vector3d(0, 0, 1));
  const Eigen::Vector3d origin = cam_from_world_.OriginInSource();
  cam_from_world_.rotation = (turn * cam_from_world_.rotation).normalized();
  cam_from_world_.translation = -(cam_from_world_.rotation * origin);
}

void Navigation::SetPivot(const Eigen::Vector3d& focus) { focus_ = focus; }

void Navigation::Frame(const Eigen::Vector3d& center, double radius) {
  Leave();
  focus_ = center;
  const double aspect = std::min(1.0, double(width_) / height_);
  const double distance = std::max(radius, 1e-6) / (tan_half_fov_ * aspect) * 1.1;
  const Eigen::Vector3d origin = center - distance * Axis(cam_from_world_, 2);
  cam_from_world_.translation = -(cam_from_world_.rotation * origin);
}

Eigen::Matrix3d Navigation::Axes() const {
  const Rigid3d& home = home_ ? home_posed_.cam_from_world : Rigid3d();
  const auto level = [&](int axis) -> Eigen::Vector3d {
    const Eigen::Vector3d of = Axis(home, axis);
    return of - of.dot(up_) * up_;
  };
  // A camera on its side looks level with its forward or its down axis.
  Eigen::Vector3d right = level(0);
  if (right.norm() < kFlat) right = level(1);
  Eigen::Matrix3d axes;
  axes.col(2) = up_;
  axes.col(0) = right.normalized();
  axes.col(1) = up_.cross(axes.col(0));
  return axes;
}

void Navigation::LookFrom(const Eigen::Vector3d& from) {
  Leave();
  const double distance = (cam_from_world_.OriginInSource() - focus_).norm();
  const Eigen::Vector3d forward = -from.normalized();
  Eigen::Vector3d right = forward.cross(up_);
  if (right.norm() < kFlat) {
    const Eigen::Vector3d old = Axis(cam_from_world_, 0);
    right = old - old.dot(forward) * forward;
    if (right.norm() < kFlat) right = forward.unitOrthogonal();
  }
  Eigen::Matrix3d world_from_cam;  // x right, y down, z forward
  world_from_cam.col(0) = right.normalized();
  world_from_cam.col(1) = forward.cross(world_from_cam.col(0));
  world_from_cam.col(2) = forward;
  cam_from_world_.rotation = Eigen::Quaterniond(world_from_cam.transpose()).normalized();
  cam_from_world_.translation = -(cam_from_world_.rotation * (focus_ - distance * forward));
}

void Navigation::Reset() {
  if (home_) GoTo(*home_, home_posed_);
}

std::vector<PosedCamera> Navigation::Turntable(int count, int width, int height) const {
  Navigation copy = *this;
  copy.Leave();
  copy.SetViewport(width, height);
  std::vector<PosedCamera> cameras;
  for (int i = 0; i < count; ++i) {
    cameras.push_back(copy.Rendered());
    copy.Turn(copy.focus_, 2 * std::numbers::pi / count, 0);
  }
  return cameras;
}

}  // namespace retint
