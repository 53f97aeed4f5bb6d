// SPDX-License-Identifier: BSD-3-Clause
// The tiny world as Gaussians: thin discs on the ball and the wall.
#pragma once

#include <cmath>

#include <Eigen/Geometry>

#include "scene/gaussian_model.h"
#include "tests/selection/tiny_world.h"

namespace retint {

struct TinyGaussians {
  GaussianModel model;
  std::vector<bool> on_ball;  // [N]

  void Add(const Eigen::Vector3d& at, const Eigen::Vector3d& normal, double size, bool ball) {
    const Eigen::Quaterniond turn =
        Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), normal);
    const Eigen::Vector4d wxyz(turn.w(), turn.x(), turn.y(), turn.z());
    const double scales[3] = {size, size, 0.05 * size};
    for (int i = 0; i < 3; ++i) {
      model.means.push_back(float(at[i]));
      model.log_scales.push_back(float(std::log(scales[i])));
      model.sh.push_back(ball ? 0.8f : -0.5f);
    }
    for (int i = 0; i < 4; ++i) model.quats_wxyz.push_back(float(wxyz[i]));
    model.opacity_logits.push_back(3);
    on_ball.push_back(ball);
  }

  // A round one that lets two thirds of the light through.
  void AddFloater(const Eigen::Vector3d& at, double size) {
    Add(at, Eigen::Vector3d::UnitZ(), size, false);
    model.log_scales.back() = float(std::log(size));
    model.opacity_logits.back() = float(std::log(1.0 / 2));
  }

  explicit TinyGaussians(const TinyWorld& world) {
    constexpr int kBall = 4000;
    for (int i = 0; i < kBall; ++i) {  // a Fibonacci lattice
      const double y = 1 - 2 * (i + 0.5) / kBall, around = i * M_PI * (3 - std::sqrt(5.0));
      const double r = std::sqrt(1 - y * y);
      const Eigen::Vector3d normal(r * std::cos(around), y, r * std::sin(around));
      Add(world.ball_center + world.ball_radius * normal, normal, 0.04, true);
    }
    const Eigen::Vector3d across = world.wall_normal.unitOrthogonal();
    const Eigen::Vector3d up = world.wall_normal.cross(across);
    for (int i = -50; i <= 50; ++i) {
      for (int j = -50; j <= 50; ++j) {
        Add(world.wall_offset * world.wall_normal + 0.12 * (i * across + j * up), world.wall_normal,
            0.07, false);
      }
    }
  }
};

}  // namespace retint
