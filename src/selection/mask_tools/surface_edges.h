// SPDX-License-Identifier: BSD-3-Clause
// The edges at which one thing ends before another in depth.
#pragma once

#include "scene/image.h"

namespace retint {

// In [0, 1], of every pixel: how surely the surface has a valley there, as where a thing stands on
// another or ends before it; bumps, as a thing's own corners and bends, are none (after the concave
// edges by which Stein et al. 2014 divide things). Over a plane the inverse depth changes linearly
// from pixel to pixel, so its second difference, in pixels over `focal`, is the change of slope.
// A valley is sure at a slope of 1, 45 degrees, above four times the usual slope in the picture.
// `inverse_depth` in any unit, 0 where there is no surface; `focal`: pixels per radian.
ScalarImage SurfaceValleys(const ScalarImage& inverse_depth, double focal);

}  // namespace retint
