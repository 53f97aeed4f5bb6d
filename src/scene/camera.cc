// SPDX-License-Identifier: BSD-3-Clause
#include "scene/camera.h"

#include <array>

namespace retint {
namespace {

constexpr std::array kModels = {
    CameraModelInfo{CameraModelId::kSimplePinhole, "SIMPLE_PINHOLE", 3},
    CameraModelInfo{CameraModelId::kPinhole, "PINHOLE", 4},
    CameraModelInfo{CameraModelId::kSimpleRadial, "SIMPLE_RADIAL", 4},
    CameraModelInfo{CameraModelId::kRadial, "RADIAL", 5},
    CameraModelInfo{CameraModelId::kOpenCV, "OPENCV", 8},
    CameraModelInfo{CameraModelId::kOpenCVFisheye, "OPENCV_FISHEYE", 8},
    CameraModelInfo{CameraModelId::kFullOpenCV, "FULL_OPENCV", 12},
    CameraModelInfo{CameraModelId::kFov, "FOV", 5},
    CameraModelInfo{CameraModelId::kSimpleRadialFisheye, "SIMPLE_RADIAL_FISHEYE", 4},
    CameraModelInfo{CameraModelId::kRadialFisheye, "RADIAL_FISHEYE", 5},
    CameraModelInfo{CameraModelId::kThinPrismFisheye, "THIN_PRISM_FISHEYE", 12},
    CameraModelInfo{CameraModelId::kRadTanThinPrismFisheye, "RAD_TAN_THIN_PRISM_FISHEYE", 16},
    CameraModelInfo{CameraModelId::kSimpleDivision, "SIMPLE_DIVISION", 4},
    CameraModelInfo{CameraModelId::kDivision, "DIVISION", 5},
    CameraModelInfo{CameraModelId::kSimpleFisheye, "SIMPLE_FISHEYE", 3},
    CameraModelInfo{CameraModelId::kFisheye, "FISHEYE", 4},
    CameraModelInfo{CameraModelId::kEucm, "EUCM", 6},
    CameraModelInfo{CameraModelId::kEquirectangular, "EQUIRECTANGULAR", 2},
};

}  // namespace

const CameraModelInfo* FindCameraModel(int id) {
  for (const auto& model : kModels) {
    if (static_cast<int>(model.id) == id) return &model;
  }
  return nullptr;
}

const CameraModelInfo* FindCameraModel(std::string_view name) {
  for (const auto& model : kModels) {
    if (model.name == name) return &model;
  }
  return nullptr;
}

Camera Camera::Pinhole(CameraId id, int width, int height, double fx, double fy, double cx,
                       double cy) {
  return {id, CameraModelId::kPinhole, width, height, {fx, fy, cx, cy}};
}

bool Camera::IsPinhole() const {
  return (model == CameraModelId::kPinhole && params.size() == 4) ||
         (model == CameraModelId::kSimplePinhole && params.size() == 3);
}

double Camera::fx() const { return params[0]; }
double Camera::fy() const { return params[model == CameraModelId::kPinhole ? 1 : 0]; }
double Camera::cx() const { return params[model == CameraModelId::kPinhole ? 2 : 1]; }
double Camera::cy() const { return params[model == CameraModelId::kPinhole ? 3 : 2]; }

Eigen::Matrix3d Camera::K() const {
  Eigen::Matrix3d k;
  k << fx(), 0, cx(), 0, fy(), cy(), 0, 0, 1;
  return k;
}

std::optional<Eigen::Vector2d> Camera::ImgFromCam(const Eigen::Vector3d& point_in_cam) const {
  if (!IsPinhole() || !(point_in_cam.z() > 0)) return std::nullopt;
  return Eigen::Vector2d(fx() * point_in_cam.x() / point_in_cam.z() + cx(),
                         fy() * point_in_cam.y() / point_in_cam.z() + cy());
}

std::optional<Eigen::Vector2d> Camera::CamFromImg(const Eigen::Vector2d& pixel) const {
  if (!IsPinhole()) return std::nullopt;
  return Eigen::Vector2d((pixel.x() - cx()) / fx(), (pixel.y() - cy()) / fy());
}

std::optional<Eigen::Vector3d> PosedCamera::Project(const Eigen::Vector3d& point_in_world) const {
  const Eigen::Vector3d in_cam = cam_from_world * point_in_world;
  const auto pixel = camera.ImgFromCam(in_cam);
  if (!pixel) return std::nullopt;
  return Eigen::Vector3d(pixel->x(), pixel->y(), in_cam.z());
}

Eigen::Vector3d PosedCamera::Unproject(const Eigen::Vector2d& pixel, double z) const {
  const Eigen::Vector2d ray = camera.CamFromImg(pixel).value();
  return cam_from_world.Inverse() * Eigen::Vector3d(ray.x() * z, ray.y() * z, z);
}

}  // namespace retint
