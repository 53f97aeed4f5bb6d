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

  // From (x, y) to before (x1, y1).
  static GridRect Between(int x, int y, int x1, int y1) { return {x, y, x1 - x, y1 - y}; }
  int x1() const { return x + width; }
  int y1() const { return y + height; }
  bool Empty() const { return width <= 0 || height <= 0; }
  GridRect United(const GridRect& other) const {
    if (Empty()) return other;
    if (other.Empty()) return *this;
    return Between(std::min(x, other.x), std::min(y, other.y), std::max(x1(), other.x1()),
                   std::max(y1(), other.y1()));
  }
  GridRect Clipped(const GridRect& to) const {
    const GridRect clipped = Between(std::max(x, to.x), std::max(y, to.y), std::min(x1(), to.x1()),
                                     std::min(y1(), to.y1()));
    return clipped.Empty() ? GridRect{} : clipped;
  }
  bool operator==(const GridRect&) const = default;
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
