// SPDX-License-Identifier: BSD-3-Clause
// From strokes to a mask. A few strokes inside and outside of the object, or a rough mask, are
// enough: color and depth show the outline.
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "base/monitor.h"
#include "selection/mask_tools/view_layers.h"

namespace retint {

// Draws a line through `points` (pixels) with 255, `brush` pixels wide, with round ends.
void DrawStroke(const std::vector<Eigen::Vector2d>& points, double brush, Mask* mask);

// A soft mask of the object that the strokes `inside` mark, in pixels of 128 and more. So do the
// strokes `outside` for the rest; if that mask is empty, the picture's edge is outside.
//
// Mixtures of Gaussians of color and depth describe inside and outside. They are learned from the
// strokes and again from each result, as in GrabCut (Rother et al. 2004). The distance from the
// strokes along surfaces counts too (Price et al. 2010). A cut (min_cut.h) finds the cheapest
// border, along edges of color and creases of the surface (surface_edges.h). A pixel may be an
// outside surface in a shadow. Parts without a way to an inside stroke become outside. So does a
// surface between creases that has no inside stroke and is mostly outside. Large views are solved
// at 100,000 pixels, then refined at full size. OptionError if no pixel is inside, or one is inside
// and outside.
//
// `undecided`, if not null, becomes 255 in pixels that the view does not decide, else 0. They
// change side if all log odds change by 2, the most that color can say, or are cut off from all
// inside strokes. Stroked pixels are decided.
Mask MaskFromScribbles(const ViewLayers& layers, const Mask& inside, const Mask& outside,
                       Monitor& monitor, Mask* undecided = nullptr);

// Moves the border of `mask` to edges of color and depth that lie within `radius` pixels of it, and
// makes it as soft as they are. Pixels farther away do not change. `favor`: log odds of "inside"
// that are added to those of every pixel this close.
Mask RefineEdge(const ViewLayers& layers, const Mask& mask, int radius, Monitor& monitor,
                double favor = 0);

// The pixels that RefineEdge() reads: around the inside. Empty if the mask has no border.
GridRect PartAboutBorder(const Mask& mask, int radius);
// RefineEdge() for that part, once for each of `favors`. `features` (view_layers.h) and `mask` are
// of the part, [height, width]. `focal`: pixels per radian.
std::vector<Mask> RefineEdgeOfPart(const PixelArray<float, 4>& features, double focal,
                                   const Mask& mask, int radius, std::span<const double> favors,
                                   Monitor& monitor);

}  // namespace retint
