// SPDX-License-Identifier: BSD-3-Clause
// Soft mattes that follow the edges of a picture.
#pragma once

#include <span>
#include <vector>

#include "scene/image.h"

namespace retint {

// The guided filter (He, Sun and Tang 2013) of each of `values`, [h, w], with a guide of four
// channels: in every window of `radius` pixels about a pixel the result is an affine function of
// the guide. The functions are found with `small`, the guide at the size of `values`, and applied
// to `guide`, which may be larger (He and Sun 2015), in the pixels of `wanted` that are not 0; the
// others become 0. `variance`: of the guide below which a window counts as flat. Clamped to [0, 1],
// of the guide's size.
std::vector<ScalarImage> GuidedMattes(std::span<const ScalarImage> values,
                                      const PixelArray<float, 4>& small,
                                      const PixelArray<float, 4>& guide, const Mask& wanted,
                                      int radius, double variance = 1e-4);

// The mean of the pixels that each pixel of the new size covers, or, in a larger one, bilinear.
PixelArray<float, 4> Resized(const PixelArray<float, 4>& image, int width, int height);

}  // namespace retint
