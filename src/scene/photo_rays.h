// SPDX-License-Identifier: BSD-3-Clause
// The directions of a distorted photo's pixels.
#pragma once

#include "scene/image.h"
#include "scene/undistortion.h"

namespace retint {

// The point that each of the photo's pixels shows at depth 1, in its camera's frame; 0 for a pixel
// without a ray. Undistortion::DepthIsDistance() says which depth that is. [H, W, 3]
PixelArray<float, 3> PhotoRays(const Undistortion& undistortion);

}  // namespace retint
