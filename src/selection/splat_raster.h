// SPDX-License-Identifier: BSD-3-Clause
// Drawing a selection cloud into a view, with a depth test per pixel.
#pragma once

#include "scene/camera.h"
#include "scene/image.h"
#include "selection/selection_cloud.h"

namespace retint {

// Both return coverage in [0, 1], [H, W]: the largest of the points that cover a pixel. A point
// further than depth * (1 + tolerance) is hidden; pixels without depth hide nothing.

// The paper's: a square of `side` pixels about each projected point, as deep as the point.
ScalarImage DrawQuads(const SelectionCloud& cloud, const PosedCamera& view, const DepthMap& depth,
                      double side, double depth_tolerance);

// Each point a disc in the world: across its normal (facing the viewer where it has none), of
// radius `scale` footprints; the depth of its plane is tested at every pixel. Full within the
// radius less half a footprint, fading to 0 half a footprint outside.
ScalarImage DrawSurfels(const SelectionCloud& cloud, const PosedCamera& view, const DepthMap& depth,
                        double scale, double depth_tolerance);

}  // namespace retint
