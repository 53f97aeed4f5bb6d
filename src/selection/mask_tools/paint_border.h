// SPDX-License-Identifier: BSD-3-Clause
// Where paint stops a few pixels before or beyond the edge of the object that the user meant.
#pragma once

#include "base/monitor.h"
#include "selection/mask_tools/view_layers.h"

namespace retint {

// Pixels between the border of the paint and the edge of the object, which a hand misses by a few
// pixels. Each mask is 255 there and 0 elsewhere. Both are empty if no pixel or every pixel is
// painted.
struct MissedBorder {
  Mask left_out;  // unpainted (below 128), but inside the edge
  Mask spilled;   // painted, but outside the edge
};

// Looks for edges of color or depth up to `reach` pixels from the border of `mask`. Nothing is
// missed if the paint itself ends at an edge, or if no edge is within reach, as on a plain wall.
MissedBorder FindMissedBorder(const ViewLayers& layers, const Mask& mask, int reach,
                              Monitor& monitor);

// 1 in pixels that lie more than `reach` rows or columns from the border of `mask`, else 0.
ScalarImage FarFromBorder(const Mask& mask, int reach);

}  // namespace retint
