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

// Depth at a continuous pixel: bilinear in 1/z, exact on planes. nullopt outside the image, and if
// the four pixels around lack depth or disagree by more than `max_spread` of the depth.
std::optional<double> SampleDepth(const DepthMap& depth, const Eigen::Vector2d& pixel,
                                  double max_spread = 0.03);

// Unit normal of the surface seen in pixel (x, y), camera frame, towards the camera. On a plane 1/z
// = A u + B v + C with (u, v) the ray, and (A, B, C) is the normal's direction. Slopes of 1/z are
// taken over up to 3 pixels both ways: averaged where the surface is smooth, on the flatter side at
// a depth edge. Faces the camera where no neighbor has depth.
Eigen::Vector3d NormalFromDepth(const Camera& camera, const DepthMap& depth, int x, int y);

// Whether a pixel above 0 lies within a disc of `radius` pixels about (x, y).
bool IsNearMask(const Mask& mask, int x, int y, int radius);

}  // namespace retint
