// SPDX-License-Identifier: BSD-3-Clause
// An edit of colors, an affine map of each RGB triple or a list of operations, blended in by a soft
// mask.
#pragma once

#include <cstdint>

#include "kernels/common/color_ops.h"
#include "kernels/common/macros.h"

namespace retint {

// y + mask / 255 * (delta y + offset) per RGB triple: ColorEdit with delta = gain - identity.
struct ColorMap {
  float delta[9];  // row-major
  float offset[3];
  // In the memory of the backend. Where not null, y + mask / 255 * (f(y) - y) instead, f the
  // program.
  const ColorProgram* program = nullptr;
};

// `edited` may be `color`, both [3]. A mask of 0 keeps every bit of the color.
RETINT_HD void ApplyColorMap(const ColorMap& map, uint8_t mask, const float* color, float* edited) {
  const float share = float(mask) * (1.0f / 255);
  const float r = color[0], g = color[1], b = color[2];
  if (map.program) {
    float full[3] = {r, g, b};
    if (mask > 0) RunColorProgram(*map.program, full);
    for (int c = 0; c < 3; ++c) edited[c] = color[c] + share * (full[c] - color[c]);
    return;
  }
  for (int c = 0; c < 3; ++c) {
    const float* row = map.delta + 3 * c;
    edited[c] = color[c] + share * (row[0] * r + row[1] * g + row[2] * b + map.offset[c]);
  }
}

}  // namespace retint
