// SPDX-License-Identifier: BSD-3-Clause
// Which similarities bring one colored point cloud onto another, without a first guess.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "base/monitor.h"
#include "scene/gaussian_model.h"
#include "scene/reconstruction.h"
#include "scene/rigid3d.h"

namespace retint {

struct ColoredCloud {
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector3d> colors;  // RGB in [0, 1]
};

ColoredCloud CloudOf(const Reconstruction& model);  // the sparse points
ColoredCloud CloudOf(const GaussianModel& model);   // centers and base colors of visible Gaussians

struct RegisteredCloud {
  Sim3d to_from_from;  // x_in_to = to_from_from * x_in_from
  double score = 0;    // share of both clouds' points that have one of their color near, in [0, 1]
};

// The first guesses are the principal axes in all their 24 orders and signs, at three scales. Each
// is refined by iterated closest points in both directions, so that the scale cannot collapse.
// Weights depend on color and on a distance that shrinks (Fitzgibbon 2003; Umeyama 1991 for the
// similarity). Returns up to `most` different results, best first; none if a cloud has under 20
// points. Stage: "points".
std::vector<RegisteredCloud> RegisterClouds(const ColoredCloud& from, const ColoredCloud& to,
                                            size_t most, Monitor& monitor);

}  // namespace retint
