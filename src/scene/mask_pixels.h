// SPDX-License-Identifier: BSD-3-Clause
// Which pixels of a soft mask are inside (docs/conventions.md).
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "scene/image.h"

namespace retint {

inline bool IsInside(uint8_t value) { return value >= 128; }

inline bool AnyInside(const Mask& mask) {
  return std::any_of(mask.data.begin(), mask.data.end(), IsInside);
}

inline size_t CountInside(const Mask& mask) {
  return static_cast<size_t>(std::count_if(mask.data.begin(), mask.data.end(), IsInside));
}

// Of all pixels; 0 of none.
inline double FractionInside(const Mask& mask) {
  return static_cast<double>(CountInside(mask)) /
         static_cast<double>(std::max<size_t>(1, mask.NumPixels()));
}

}  // namespace retint
