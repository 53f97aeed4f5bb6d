// SPDX-License-Identifier: BSD-3-Clause
// Whether a picture shows a view, also if parts of it were painted over.
#pragma once

#include "scene/image.h"

namespace retint {

// The mean difference, 0 to 1, between a picture and a view of its size in the half of their values
// that differ least: painted pixels do not count.
double MeanDifference(const Image8& picture, const Image& view);

// Of how much neighboring pixels differ in a picture and in a view of its size, both at a quarter
// of their size: near 1 where they show the same, whatever its colors, and small where they do not.
// Looks beside `changed` alone (no pixels: everywhere), where the picture should be as the view is,
// unless that is little or flat.
double EdgeCorrelation(const Image8& picture, const Image& view, const Mask& changed = {});

}  // namespace retint
