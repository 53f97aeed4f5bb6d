// SPDX-License-Identifier: BSD-3-Clause
#include "scene/transform.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/recolor/tiny_scene.h"

namespace retint {
namespace {

// The scene and its cameras moved alike look as before: means, rotations, scales and the spherical
// harmonics of every degree turn together.
TEST(Transform, AMovedSplatRendersTheSameFromMovedCameras) {
  for (const int degree : {0, 1, 2, 3}) {
    TinyScene scene(7, 120, 2, degree);
    TestRandom random(3);
    for (float& q : scene.model.quats_wxyz) q = float(random.Uniform(-1, 1));
    for (size_t i = 0; i < scene.model.log_scales.size(); i += 3) scene.model.log_scales[i] -= 1;
    const Sim3d move{1.7, Eigen::Quaterniond(0.3, -0.6, 0.5, 0.4).normalized(), {5, -2, 1}};
    GaussianModel moved = scene.model;
    Transform(move, moved);
    Reconstruction views;
    views.cameras[1] = scene.cameras[1].camera;
    views.views[1].camera_id = 1;
    views.views[1].cam_from_world = scene.cameras[1].cam_from_world;
    Transform(move, views);
    const Image before = Renderer(scene.backend, scene.model).Render(scene.cameras[1]).rgb;
    const Image after = Renderer(scene.backend, moved).Render(views.Posed(views.views.at(1))).rgb;
    double squares = 0, contrast = 0;
    for (size_t i = 0; i < before.data.size(); ++i) {
      squares += std::pow(double(before.data[i]) - double(after.data[i]), 2);
      contrast +=
          std::pow(double(before.data[i]) - double(before.data[(i + 3) % before.data.size()]), 2);
    }
    // Single precision; a Gaussian at the edge of the smallest weight that is drawn may come or go.
    EXPECT_LT(std::sqrt(squares / double(before.data.size())), 1e-3) << degree;
    EXPECT_GT(std::sqrt(contrast / double(before.data.size())), 0.02) << "an empty picture";
  }
}

TEST(Transform, ComposesLikeFunctions) {
  const Sim3d a{2, Eigen::Quaterniond(0.3, -0.6, 0.5, 0.4).normalized(), {5, -2, 1}};
  const Sim3d b{0.3, Eigen::Quaterniond(0.9, 0.1, -0.2, 0.4).normalized(), {-1, 0.5, 3}};
  const Eigen::Vector3d x(0.7, -0.1, 4);
  EXPECT_LT((Compose(a, b) * x - a * (b * x)).norm(), 1e-12);
  EXPECT_LT((Compose(a.Inverse(), a) * x - x).norm(), 1e-12);
}

}  // namespace
}  // namespace retint
