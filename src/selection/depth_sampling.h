// SPDX-License-Identifier: BSD-3-Clause
// Reading a depth map between pixels and its surface normals, with care at depth edges; masks
// grown.
#pragma once

#include <optional>

#include <Eigen/Core>

#include "scene/camera.h"
#include "scene/image.h"

namespace retint {

inline bool HasDepth(const DepthMap& depth, int x, int y) {
  const float z = depth(x, y);
  return z > 0 && z < std::numeric_limits<float>::infinity();
}

// Depth at a continuous pixel, bilinear in 1/z, so exact on planes. Outside the image nullopt, and
// if the four pixels around have no depth or differ by more than `max_spread` of it.
std::optional<double> SampleDepth(const DepthMap& depth, const Eigen::Vector2d& pixel,
                                  double max_spread = 0.03);

// Unit normal of the surface in pixel (x, y), in the camera frame, toward the camera. On a plane,
// 1/z = A u + B v + C for the ray (u, v, 1), and (A, B, C) is along the normal. Slopes of 1/z come
// from up to 3 pixels on both sides: their mean on a smooth surface, the flatter one at a depth
// edge. If no neighbor has depth, the normal faces the camera.
Eigen::Vector3d NormalFromDepth(const Camera& camera, const DepthMap& depth, int x, int y);

// Whether a pixel above 0 lies within a disc of `radius` pixels about (x, y).
bool IsNearMask(const Mask& mask, int x, int y, int radius);

}  // namespace retint
