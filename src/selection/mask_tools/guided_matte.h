// SPDX-License-Identifier: BSD-3-Clause
// Soft mattes that follow the edges of a picture.
#pragma once

#include <span>
#include <vector>

#include "scene/image.h"

namespace retint {

// The guided filter (He, Sun and Tang 2013) of each of `values`, [h, w], with a four-channel
// guide. In every window of `radius` pixels around a pixel, the result is an affine function of
// the guide. The functions are fitted to `small`, the guide at the size of `values`, and applied
// to `guide`, which may be larger (He and Sun 2015). Results are in [0, 1] and of the guide's
// size; pixels outside `wanted` are 0. A window counts as flat if the guide varies less than
// `variance`.
std::vector<ScalarImage> GuidedMattes(std::span<const ScalarImage> values,
                                      const PixelArray<float, 4>& small,
                                      const PixelArray<float, 4>& guide, const Mask& wanted,
                                      int radius, double variance = 1e-4);

// A smaller image has the means of the pixels that each pixel covers; a larger one is bilinear.
PixelArray<float, 4> Resized(const PixelArray<float, 4>& image, int width, int height);

}  // namespace retint
