// SPDX-License-Identifier: BSD-3-Clause
// Paint that stops a few pixels before or beyond the edge of the thing that was meant.
#pragma once

#include "base/monitor.h"
#include "selection/mask_tools/view_layers.h"

namespace retint {

// The pixels in which paint misses the edge of color or depth at which the painted thing ends, by
// as much as a hand does. Each is 255 there and 0 elsewhere, and empty where nothing was painted or
// all.
struct MissedBorder {
  Mask left_out;  // not painted (below 128), and before the edge
  Mask spilled;   // painted, and beyond the edge
};

// Of the border of `mask`, up to `reach` pixels from where the paint ends. If the paint itself ends
// at an edge, or there is none within reach, as on a plain wall, nothing was missed.
MissedBorder FindMissedBorder(const ViewLayers& layers, const Mask& mask, int reach,
                              Monitor& monitor);

// 1 of every pixel that lies more than `reach` rows or columns from the border of `mask`, else 0.
ScalarImage FarFromBorder(const Mask& mask, int reach);

}  // namespace retint
