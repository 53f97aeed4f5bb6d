// SPDX-License-Identifier: BSD-3-Clause
// The camera that explores a scene: exactly a training view, or free. Angles in radians, lengths in
// the workspace's unit, drags in pixels of the viewport. Knows nothing of Qt.
#pragma once

#include <Eigen/Core>

#include "scene/reconstruction.h"

namespace retint {

class Navigation {
 public:
  // Finds up, center and size of the scene from its views and points; starts at the first view by
  // name. Up is orthogonal to the views' right axes, because people hold cameras level more often
  // than straight ahead. If these leave a choice, it is closest to the views' own up.
  void SetScene(const Reconstruction& reconstruction);
  // The start of the exploration, to which Reset() goes back.
  void SetHome(const View& view, const PosedCamera& posed);
  void SetViewport(int width, int height);  // pixels that are rendered

  // The camera to show. A view: its exact pose and intrinsics, with its distortion and aspect, as
  // large as the viewport allows. Free: the whole viewport, with square pixels and the principal
  // point in the middle.
  PosedCamera Rendered() const;
  // Of a view, its own camera at its own size; free: Rendered().
  PosedCamera Exact() const;

  const View* view() const { return view_; }  // null: free
  void GoTo(const View& view, const PosedCamera& posed);
  void SetFree(const PosedCamera& camera, const Eigen::Vector3d& focus);

  // All calls below leave the view, if any. Orbit() and Look() also turn the horizon level in
  // steps; a level horizon stays level.
  void Orbit(double dx, double dy);  // about the focus, wherever that is seen
  void Look(double dx, double dy);   // on the spot
  void Pan(double dx, double dy);
  void Zoom(double steps);  // wheel notches, positive: nearer
  // Moves along the camera's axes: right, down, forward, each in [-1, 1], for `seconds`.
  void Fly(const Eigen::Vector3d& direction, double seconds, double factor);
  void SetFocus(const Eigen::Vector3d& focus);  // the camera turns to it
  void SetPivot(const Eigen::Vector3d& focus);  // the camera stays
  void Frame(const Eigen::Vector3d& center, double radius);
  // Looks from a direction, at the same distance to the focus. From above or below, the picture's
  // up changes as little as possible.
  void LookFrom(const Eigen::Vector3d& from);
  void Reset();

  const Eigen::Vector3d& focus() const { return focus_; }
  const Eigen::Vector3d& up() const { return up_; }
  const Eigen::Vector3d& center() const { return center_; }
  double radius() const { return radius_; }
  // Columns X, Y, Z of the scene in the world: Z is up, X is level and as near to the home view's
  // right as that allows. Right-handed.
  Eigen::Matrix3d Axes() const;

  // `count` cameras on a circle around the focus and the up axis, beginning at the camera.
  std::vector<PosedCamera> Turntable(int count, int width, int height) const;

 private:
  void Leave();
  // Rotates the camera about a point of the world.
  void RotateAbout(const Eigen::Vector3d& point, const Eigen::Quaterniond& world_rotation);
  void Turn(const Eigen::Vector3d& about, double yaw, double pitch);
  // Takes a share of the horizon's tilt away; the point stays where it is seen.
  void Level(const Eigen::Vector3d& about, double share);
  double FocalPixels() const;  // of the free camera

  Rigid3d cam_from_world_;
  double tan_half_fov_ = 0.5;  // vertical, of the free camera
  Eigen::Vector3d focus_ = {0, 0, 1}, up_ = {0, -1, 0}, center_ = {0, 0, 0};
  double radius_ = 1;
  const View* view_ = nullptr;
  PosedCamera posed_;  // of view_
  const View* home_ = nullptr;
  PosedCamera home_posed_;
  int width_ = 1, height_ = 1;
};

}  // namespace retint
