// SPDX-License-Identifier: BSD-3-Clause
// Posed pinhole camera maths on CameraParams (COLMAP's frame: x right, y down, z forward).
#pragma once

#include <glm/mat3x3.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "kernels/common/macros.h"
#include "kernels/common/types.h"

namespace retint {

// cam_from_world rotation; GLM is column-major.
RETINT_HD glm::mat3 RotationOf(const CameraParams& camera) {
  const float* r = camera.rotation;
  return glm::mat3(r[0], r[3], r[6], r[1], r[4], r[7], r[2], r[5], r[8]);
}

RETINT_HD glm::vec3 CamFromWorld(const CameraParams& camera, const glm::vec3& x_in_world) {
  return RotationOf(camera) * x_in_world +
         glm::vec3(camera.translation[0], camera.translation[1], camera.translation[2]);
}

// Pixel of a point in front of the camera; the centre of the top-left pixel is (0.5, 0.5).
RETINT_HD glm::vec2 ImgFromCam(const CameraParams& camera, const glm::vec3& x_in_cam) {
  return {camera.fx * x_in_cam.x / x_in_cam.z + camera.cx,
          camera.fy * x_in_cam.y / x_in_cam.z + camera.cy};
}

}  // namespace retint
