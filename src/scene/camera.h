// SPDX-License-Identifier: BSD-3-Clause
// Camera models as COLMAP numbers and names them (COLMAP src/colmap/sensor/models.h,
// doc/cameras.rst).
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "scene/rigid3d.h"

namespace retint {

using CameraId = uint32_t;

enum class CameraModelId : int {
  kSimplePinhole = 0,
  kPinhole = 1,
  kSimpleRadial = 2,
  kRadial = 3,
  kOpenCV = 4,
  kOpenCVFisheye = 5,
  kFullOpenCV = 6,
  kFov = 7,
  kSimpleRadialFisheye = 8,
  kRadialFisheye = 9,
  kThinPrismFisheye = 10,
  kRadTanThinPrismFisheye = 11,
  kSimpleDivision = 12,
  kDivision = 13,
  kSimpleFisheye = 14,
  kFisheye = 15,
  kEucm = 16,
  kEquirectangular = 17,
};

struct CameraModelInfo {
  CameraModelId id;
  std::string_view name;  // "PINHOLE"
  int num_params;
};

// nullptr for a model that COLMAP does not define.
const CameraModelInfo* FindCameraModel(int id);
const CameraModelInfo* FindCameraModel(std::string_view name);

struct Camera {
  CameraId id = 0;
  CameraModelId model = CameraModelId::kPinhole;
  int width = 0, height = 0;  // pixels
  std::vector<double>
      params;  // COLMAP's order: focal length(s), principal point, distortion; pixels

  static Camera Pinhole(CameraId id, int width, int height, double fx, double fy, double cx,
                        double cy);

  // PINHOLE and SIMPLE_PINHOLE: the models that can be rendered directly.
  bool IsPinhole() const;
  // Of the two pinhole models only.
  double fx() const, fy() const, cx() const, cy() const;
  Eigen::Matrix3d K() const;

  // Pixel (center of the top-left pixel is (0.5, 0.5)) of a point in the camera frame (x right, y
  // down, z forward). nullopt behind the camera (z <= 0), and for a model that is not pinhole.
  std::optional<Eigen::Vector2d> ImgFromCam(const Eigen::Vector3d& point_in_cam) const;
  // The ray (x/z, y/z) through a pixel; nullopt for a model that is not pinhole.
  std::optional<Eigen::Vector2d> CamFromImg(const Eigen::Vector2d& pixel) const;

  bool operator==(const Camera&) const = default;
};

// A camera and where it stands: all that rendering needs.
struct PosedCamera {
  Camera camera;
  Rigid3d cam_from_world;

  // Pixel and depth of a world point, in front of the camera; not clipped to the image.
  std::optional<Eigen::Vector3d> Project(const Eigen::Vector3d& point_in_world) const;  // x, y, z
  // The world point at depth z seen in `pixel`.
  Eigen::Vector3d Unproject(const Eigen::Vector2d& pixel, double z) const;
  Eigen::Vector3d Center() const { return cam_from_world.OriginInSource(); }

  bool operator==(const PosedCamera&) const = default;
};

}  // namespace retint
