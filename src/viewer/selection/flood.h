// SPDX-License-Identifier: BSD-3-Clause
// The flood tool's fill: OpenCV's knows colors, but no depth edges between pixels.
#pragma once

#include "scene/image.h"
#include "viewer/selection/mask_editor.h"

namespace retint {

// 255 on the pixels that a path of 4-neighbors connects to (x, y) on which every pixel's color is
// within options.tolerance of the seed's and no step from one pixel to the next crosses a depth
// edge (a relative step above options.depth_edge, or the border of what has depth). `depth` without
// pixels: color alone.
Mask FloodFill(const Image8& image, const DepthMap& depth, int x, int y,
               const FloodOptions& options);

}  // namespace retint
