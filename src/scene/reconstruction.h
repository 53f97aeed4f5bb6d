// SPDX-License-Identifier: BSD-3-Clause
// A sparse COLMAP model: cameras, posed images ("views"), points with tracks. Ids are COLMAP's and
// may be sparse.
#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "scene/camera.h"
#include "scene/rigid3d.h"

namespace retint {

using ViewId = uint32_t;   // COLMAP's image_t
using PointId = uint64_t;  // COLMAP's point3D_t
inline constexpr PointId kInvalidPointId = std::numeric_limits<PointId>::max();

struct Observation {
  Eigen::Vector2d xy;  // pixels, COLMAP's convention (pixel center at 0.5)
  PointId point_id = kInvalidPointId;
};

struct View {
  ViewId id = 0;
  std::string name;  // relative to the image folder, '/' separated
  CameraId camera_id = 0;
  Rigid3d cam_from_world;
  std::vector<Observation> observations;
};

struct TrackElement {
  ViewId view_id = 0;
  uint32_t observation_idx = 0;
};

struct SparsePoint {
  PointId id = 0;
  Eigen::Vector3d xyz;  // world
  Eigen::Matrix<uint8_t, 3, 1> color = {0, 0, 0};
  double error = -1;  // mean reprojection error in pixels; -1 unknown
  std::vector<TrackElement> track;
};

struct Reconstruction {
  std::map<CameraId, Camera> cameras;  // sorted by id, as COLMAP writes them
  std::map<ViewId, View> views;
  std::map<PointId, SparsePoint> points;

  // nullptr when there is none.
  const View* FindView(std::string_view name) const;
  // Up to `count` view names closest to `name` by edit distance, nearest first.
  std::vector<std::string> NearestNames(std::string_view name, int count = 3) const;
  PosedCamera Posed(const View& view) const;  // precondition: its camera exists
  // Views sorted by name, the order in which --holdout counts.
  std::vector<const View*> ViewsByName() const;
};

}  // namespace retint
