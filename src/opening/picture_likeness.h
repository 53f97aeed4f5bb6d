// SPDX-License-Identifier: BSD-3-Clause
// Whether a picture shows a view, also if parts of it were painted over.
#pragma once

#include "scene/image.h"

namespace retint {

// The mean difference, 0 to 1, between a picture and a view of its size in the half of their values
// that differ least: painted pixels do not count.
double MeanDifference(const Image8& picture, const Image& view);

// The correlation of edges, the differences of neighboring pixels, in a picture and a view of its
// size, both at a quarter of their size. It is near 1 if they show the same, whatever the colors,
// and small if not. It looks only beside `changed` (no pixels: everywhere), where the picture
// should be like the view, unless that part is small or flat.
double EdgeCorrelation(const Image8& picture, const Image& view, const Mask& changed = {});

}  // namespace retint
