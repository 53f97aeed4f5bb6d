// SPDX-License-Identifier: BSD-3-Clause
// Creases: edges at which one object ends and another begins in depth.
#pragma once

#include "scene/image.h"

namespace retint {

// For every pixel in [0, 1]: how surely the surface has a crease there, or valley, as where an
// object stands on another or occludes it. Convex edges, such as an object's own corners, are no
// creases (after the concave edges by which Stein et al. 2014 separate objects). Over a plane,
// inverse depth is linear in pixels, so its second difference over `focal` is the change of slope.
// A crease is sure at a slope change of 1, 45 degrees, above four times the picture's usual one.
// `inverse_depth`: in any unit, 0: no surface. `focal`: pixels per radian.
ScalarImage SurfaceValleys(const ScalarImage& inverse_depth, double focal);

}  // namespace retint
