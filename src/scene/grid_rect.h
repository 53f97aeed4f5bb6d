// SPDX-License-Identifier: BSD-3-Clause
// Parts of pixel arrays.
#pragma once

#include <algorithm>
#include <cstddef>

#include "scene/image.h"

namespace retint {

// A part of a view's pixel grid.
struct GridRect {
  int x = 0, y = 0, width = 0, height = 0;
};

// `rect` lies within the image.
template <typename T, int C>
PixelArray<T, C> Crop(const PixelArray<T, C>& image, const GridRect& rect) {
  PixelArray<T, C> out(rect.width, rect.height);
  for (int y = 0; y < rect.height; ++y) {
    std::copy_n(&image(rect.x, rect.y + y), size_t(rect.width) * C, &out(0, y));
  }
  return out;
}

// `part`, [rect.height, rect.width], into its place.
template <typename T>
void Place(const T* part, const GridRect& rect, PixelArray<T, 1>* image) {
  for (int y = 0; y < rect.height; ++y) {
    std::copy_n(part + size_t(y) * size_t(rect.width), rect.width, &(*image)(rect.x, rect.y + y));
  }
}

}  // namespace retint
