// SPDX-License-Identifier: BSD-3-Clause
// Soft mattes that follow the edges of a picture.
#pragma once

#include "scene/image.h"

namespace retint {

// The guided filter (He, Sun and Tang 2013) of `values`, [h, w], with a guide of four channels: in
// every window of `radius` pixels about a pixel the result is an affine function of the guide. The
// guide may be of a larger size of the same shape: then the functions are found at the size of
// `values` and applied at the guide's (He and Sun 2015). `variance`: of the guide below which a
// window counts as flat. Clamped to [0, 1], of the guide's size.
ScalarImage GuidedMatte(const ScalarImage& values, const PixelArray<float, 4>& guide, int radius,
                        double variance = 1e-4);

// The mean of the pixels that each pixel of the new size covers, or, in a larger one, bilinear.
ScalarImage Resized(const ScalarImage& image, int width, int height);
PixelArray<float, 4> Resized(const PixelArray<float, 4>& image, int width, int height);

}  // namespace retint
