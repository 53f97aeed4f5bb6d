// SPDX-License-Identifier: BSD-3-Clause
#include "scene/photo_rays.h"

#include "scene/camera_projection.h"
#include "scene/smooth_map.h"

namespace retint {

PixelArray<float, 3> PhotoRays(const Undistortion& undistortion) {
  const Camera& camera = undistortion.photo;
  const CameraProjection projection(camera);
  PixelArray<float, 3> rays(camera.width, camera.height);
  // The size of a small part of a pixel in the middle.
  const double tolerance = 1.0 / 4096 / undistortion.faces.front().camera.fx();
  const auto ray_of = [&](double x, double y) {
    auto ray = projection.CamFromImg({x, y});
    if (ray && !undistortion.DepthIsDistance()) *ray /= ray->z();
    return ray;
  };
  ForSmooth<Eigen::Vector3d>(camera.width, camera.height, tolerance, ray_of,
                             [&](int x, int y, const Eigen::Vector3d& ray) {
                               for (int c = 0; c < 3; ++c) rays(x, y, c) = float(ray[c]);
                             });
  return rays;
}

}  // namespace retint
