// SPDX-License-Identifier: BSD-3-Clause
// Paint that stops a few pixels short of the edge of what was meant.
#pragma once

#include "base/monitor.h"
#include "selection/mask_tools/view_layers.h"

namespace retint {

// What a painter leaves out at the border of `mask`: 255 in pixels that are not painted (below 128)
// but lie, within `reach` pixels of paint, before the edge of color or depth at which the painted
// thing ends; else 0. Where the paint itself ends at an edge, and where there is none within reach,
// as on a plain wall, nothing was left out.
Mask LeftOutAtBorder(const ViewLayers& layers, const Mask& mask, int reach, Monitor& monitor);

}  // namespace retint
