// SPDX-License-Identifier: BSD-3-Clause
// Pictures side by side, for reports and the demo.
#pragma once

#include <vector>

#include "scene/image.h"

namespace retint {

// Rows of pictures in one picture, with a light gap between them. Every cell is `cell_width` pixels
// wide, and its height has the shape of the first picture. Pictures are resampled by area (smaller)
// or bilinearly (larger). InputError if there is no picture or rows differ in length.
Image8 ContactSheet(const std::vector<std::vector<Image8>>& rows, int cell_width, int gap = 6);

// The nearest 8-bit picture.
Image8 ToImage8(const Image& image);
Image ToImage(const Image8& picture);

// `image` with the selected pixels tinted and the others darkened and grayed, so that the mask's
// border can be judged.
Image8 MaskOverlay(const Image& image, const Mask& mask);

}  // namespace retint
