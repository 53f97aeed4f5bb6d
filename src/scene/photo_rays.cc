// SPDX-License-Identifier: BSD-3-Clause
#include "scene/photo_rays.h"

#include "base/parallel.h"
#include "scene/camera_projection.h"

namespace retint {

PixelArray<float, 3> PhotoRays(const Undistortion& undistortion) {
  const Camera& camera = undistortion.photo;
  const CameraProjection projection(camera);
  PixelArray<float, 3> rays(camera.width, camera.height);
  ParallelTasks(camera.height, [&](int64_t row) {
    const auto y = int(row);
    for (int x = 0; x < camera.width; ++x) {
      auto ray = projection.CamFromImg({x + 0.5, y + 0.5});
      if (!ray) continue;
      if (!undistortion.DepthIsDistance()) *ray /= ray->z();
      for (int c = 0; c < 3; ++c) rays(x, y, c) = float((*ray)[c]);
    }
  });
  return rays;
}

}  // namespace retint
