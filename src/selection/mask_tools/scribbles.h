// SPDX-License-Identifier: BSD-3-Clause
// From strokes to a mask: a few strokes inside the object and outside of it, or a rough mask, to
// the outline that color and depth show.
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "base/monitor.h"
#include "selection/mask_tools/view_layers.h"

namespace retint {

// A line through `points` (pixels), `brush` pixels wide with round ends, drawn with 255.
void DrawStroke(const std::vector<Eigen::Vector2d>& points, double brush, Mask* mask);

// A soft mask of the thing that the strokes `inside` mean (pixels of 128 and more; as `outside`,
// which may be empty: then the picture's edge is outside). As GrabCut does it (Rother et al. 2004),
// mixtures of Gaussians are learned of inside and outside and learned again from the result, here
// of color and depth together; the distance along the surfaces from the strokes (Price et al. 2010)
// is added, and the cheapest border is found as a cut (min_cut.h), cheap along edges of the color
// and valleys of the surface (surface_edges.h). A pixel is also as likely outside as its surface is
// out of a shadow. A part that is not connected to a stroke inside is outside, and so are parts of
// surfaces between valleys that are outside for the most part. Large views are solved at 100,000
// pixels, and their edges found at the full size. OptionError where no pixel is inside, or one is
// inside and outside.
//
// `undecided`, where not null: 255 in pixels that the view does not decide, else 0. Such are those
// that a change of all log odds by 2 would turn, which is the most that the color says, and those
// of parts that would be inside if they were connected to a stroke. Strokes are decided.
Mask MaskFromScribbles(const ViewLayers& layers, const Mask& inside, const Mask& outside,
                       Monitor& monitor, Mask* undecided = nullptr);

// Moves the border of `mask` to the edges of color and depth that lie within `radius` pixels of it,
// and makes it as soft as they are. Further away it stays as it was. `favor`: log odds of "inside"
// of every pixel that close, beside those of its color.
Mask RefineEdge(const ViewLayers& layers, const Mask& mask, int radius, Monitor& monitor,
                double favor = 0);

// The pixels that this looks at: those around the inside. Empty where there is no border.
GridRect PartAboutBorder(const Mask& mask, int radius);
// The same of that part, once for each of `favors`: `features` (view_layers.h) and `mask` are the
// part's, [height, width]. `focal`: pixels per radian.
std::vector<Mask> RefineEdgeOfPart(const PixelArray<float, 4>& features, double focal,
                                   const Mask& mask, int radius, std::span<const double> favors,
                                   Monitor& monitor);

}  // namespace retint
