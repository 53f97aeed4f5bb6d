// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

namespace retint {

// Whether a camera's image may have this size, in pixels. Renders and masks take memory by it; a
// longer side or a larger area is a damaged file or a slip.
constexpr bool IsImageSize(uint64_t width, uint64_t height) {
  constexpr uint64_t kMaxSide = 1'000'000, kMaxPixels = uint64_t{1} << 31;
  return width >= 1 && height >= 1 && width <= kMaxSide && height <= kMaxSide &&
         width * height <= kMaxPixels;
}

}  // namespace retint
