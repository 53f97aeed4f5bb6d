// SPDX-License-Identifier: BSD-3-Clause
// What one view shows, as the tools that look for an outline see it.
#pragma once

#include <array>

#include "scene/camera.h"
#include "scene/image.h"

namespace retint {

struct ViewLayers {
  PosedCamera camera;
  Image color;     // a render or a photo
  DepthMap depth;  // may be empty: then color alone decides
};

// OptionError unless color and depth (where there is one) have one size, of a pixel at least.
void CheckLayers(const ViewLayers& layers);

// OKLab, and the logarithm of the depth: 0 where there is none. [H, W, 4]
PixelArray<float, 4> Features(const ViewLayers& layers);

}  // namespace retint
