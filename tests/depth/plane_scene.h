// SPDX-License-Identifier: BSD-3-Clause
// A textured plane of Gaussians whose exact depth is known.
#pragma once

#include <cmath>
#include <random>

#include "scene/camera.h"
#include "scene/gaussian_model.h"
#include "scene/image.h"

namespace retint {

// z = distance + slope_x x + slope_y y, in the frame of a camera at the origin.
struct PlaneScene {
  double distance = 4, slope_x = 0, slope_y = 0;

  double Depth(const Camera& camera, double x, double y) const {
    const double u = (x - camera.cx()) / camera.fx(), v = (y - camera.cy()) / camera.fy();
    return distance / (1 - slope_x * u - slope_y * v);
  }
  DepthMap ExactDepth(const Camera& camera) const {
    DepthMap depth(camera.width, camera.height);
    for (int y = 0; y < depth.height; ++y) {
      for (int x = 0; x < depth.width; ++x) depth(x, y) = float(Depth(camera, x + 0.5, y + 0.5));
    }
    return depth;
  }
  // Opaque discs of random grey on the plane, `spacing` apart over [-extent, extent]^2.
  GaussianModel Model(double extent, double spacing, unsigned seed) const {
    const int side = int(2 * extent / spacing);
    GaussianModel model;
    model.Resize(size_t(side) * size_t(side), 0);
    std::mt19937 random(seed);
    const Eigen::Vector3d normal = Eigen::Vector3d(slope_x, slope_y, -1).normalized();
    const auto turn = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), normal);
    for (size_t g = 0; g < model.NumGaussians(); ++g) {
      const double x = (double(g % size_t(side)) + 0.5) * spacing - extent;
      const double y = (double(g / size_t(side)) + 0.5) * spacing - extent;
      model.means[3 * g] = float(x);
      model.means[3 * g + 1] = float(y);
      model.means[3 * g + 2] = float(distance + slope_x * x + slope_y * y);
      model.quats_wxyz[4 * g] = float(turn.w());
      model.quats_wxyz[4 * g + 1] = float(turn.x());
      model.quats_wxyz[4 * g + 2] = float(turn.y());
      model.quats_wxyz[4 * g + 3] = float(turn.z());
      model.log_scales[3 * g] = model.log_scales[3 * g + 1] = float(std::log(0.6 * spacing));
      model.log_scales[3 * g + 2] = float(std::log(0.01 * spacing));
      model.opacity_logits[g] = 3;
      const float grey = float(random() % 1000) / 1000 - 0.5f;
      for (int c = 0; c < 3; ++c) model.sh[3 * g + size_t(c)] = grey / 0.28209479f;
    }
    return model;
  }
};

}  // namespace retint
