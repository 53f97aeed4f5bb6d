// SPDX-License-Identifier: BSD-3-Clause
// Pixel arrays. Row-major, channels last (HWC); pixel (x, y) covers [x, x+1) × [y, y+1), its centre
// is (x + 0.5, y + 0.5).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace retint {

template <typename T, int C>
struct PixelArray {
  static constexpr int kChannels = C;
  int width = 0, height = 0;
  std::vector<T> data;  // [height, width, C]

  PixelArray() = default;
  PixelArray(int w, int h, T value = T{})
      : width(w), height(h), data(size_t(w) * size_t(h) * C, value) {}
  // A copy of pixels in memory, [h, w, C].
  static PixelArray Of(int w, int h, const T* pixels) {
    PixelArray array;
    array.width = w;
    array.height = h;
    array.data.assign(pixels, pixels + size_t(w) * size_t(h) * C);
    return array;
  }
  bool Empty() const { return data.empty(); }
  size_t NumPixels() const { return size_t(width) * size_t(height); }
  bool Contains(int x, int y) const { return x >= 0 && y >= 0 && x < width && y < height; }
  size_t Index(int x, int y) const { return (size_t(y) * size_t(width) + size_t(x)) * C; }
  T& operator()(int x, int y, int c = 0) { return data[Index(x, y) + size_t(c)]; }
  const T& operator()(int x, int y, int c = 0) const { return data[Index(x, y) + size_t(c)]; }
};

// RGB in [0, 1] as stored in the file (no gamma is undone: 3DGS trains in that space); not clamped
// above.
using Image = PixelArray<float, 3>;
using Image8 = PixelArray<uint8_t, 3>;

// Soft selection in [0, 255]: 0 outside, 255 inside.
using Mask = PixelArray<uint8_t, 1>;

// z along the camera's viewing axis, in the workspace's unit; 0 for no depth (COLMAP's dense
// convention).
using DepthMap = PixelArray<float, 1>;

// One float a pixel: alpha, weights, soft coverage in [0, 1].
using ScalarImage = PixelArray<float, 1>;

}  // namespace retint
