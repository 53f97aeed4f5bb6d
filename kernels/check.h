// SPDX-License-Identifier: BSD-3-Clause
// The checks of arguments that every operation makes before a backend runs it.
#pragma once

#include <cstdint>
#include <stdexcept>

#include "kernels/blend_ops.h"

namespace retint {

// std::invalid_argument unless `holds`.
inline void Require(bool holds, const char* otherwise) {
  if (!holds) throw std::invalid_argument(otherwise);
}

inline void RequireCount(int64_t count) { Require(count >= 0, "a count must not be negative"); }

inline void RequireWholeView(const ViewGeometry& view) {
  Require(!view.is_region(), "the operation needs the geometry of a whole view, not a region");
}

inline void RequireRegion(const ViewGeometry& view) {
  Require(view.is_region(), "the operation needs a region, not a whole view");
}

inline void RequireImage(int width, int height) {
  Require(width >= 1 && height >= 1, "an image has at least one pixel");
}

// `box`: x0, y0, x1, y1, half-open; may be empty.
inline void RequireBox(const int32_t* box, int width, int height) {
  RequireImage(width, height);
  Require(box[0] >= 0 && box[1] >= 0 && box[0] <= box[2] && box[1] <= box[3] && box[2] <= width &&
              box[3] <= height,
          "a box lies outside its image");
}

}  // namespace retint
