// SPDX-License-Identifier: BSD-3-Clause
// How a depth map agrees with the sparse points that COLMAP saw in its view.
#pragma once

#include <cstddef>

#include "scene/image.h"
#include "scene/reconstruction.h"

namespace retint {

struct SparseErrors {
  size_t points = 0;              // that the view observes, in front of it and inside its image
  size_t compared = 0;            // those of them where the map has a depth; the errors are theirs
  double median = 0, ninety = 0;  // |z - z_point| / z_point: half and nine tenths are at or below
  double median_length = 0, ninety_length = 0;  // |z - z_point| in the workspace's unit, the same
  double bias = 0;  // median of z / z_point - 1: above 0 the map is too far
};

// Over the points of the view's own observations, which nothing hides from it; the map is read at
// the pixel in which a point lies. `depth` has the size of the view's camera.
SparseErrors CompareWithSparse(const DepthMap& depth, const Reconstruction& reconstruction,
                               const View& view);

}  // namespace retint
