// SPDX-License-Identifier: BSD-3-Clause
// The operations of a color edit, on one pixel. Colors are display-referred sRGB triples, as in
// most splats. A screen shows 0 to 1. Values outside pass through wherever an operation has a
// meaning there.
#pragma once

#include <cstdint>

#include "kernels/common/color_spaces.h"
#include "kernels/common/macros.h"

namespace retint {

inline constexpr int kMaxColorOps = 16;
inline constexpr int kMaxColorOpValues = 20;

// The contents of `values` for each operation:
enum class ColorOpCode : int32_t {
  kMatrix,        // [3, 4] row-major: y' = M y + t on the encoded values
  kLinearMatrix,  // [3, 3] row-major, in linear light
  kPower,         // exponent: y' = y^exponent, odd for negative values
  kAdjust,        // see AdjustColor
  kRecolor,       // see RecolorColor
  kGradient,      // table of `size` colors by OKLab lightness from 0 to 1
  kTable,         // table of size^3 colors, red fastest, over [0, 1]^3
  kSoftClip,      // knee: see SoftClipColor
  kPalette,       // weight of lightness; table of `size` rows: see MovePalette
  kEncode,        // sRGB from a splat's colors: table of `size` values, a curve of each channel
                  // (none: the identity), then [3, 3] row-major, which gives linear light
  kDecode,        // back: [3, 3] of linear light, then the same curve the other way
};

inline constexpr int kPaletteRow = 7;  // floats

struct ColorOp {
  ColorOpCode code;
  float strength;  // y + strength (op(y) - y)
  float values[kMaxColorOpValues];
  int32_t table;  // where its table begins in ColorProgram::tables, in floats
  int32_t size;   // of the table
};

// The operations of one edit, in the order in which they apply.
struct ColorProgram {
  int32_t count;
  float strength;  // of the whole: color + strength (list(color) - color)
  ColorOp ops[kMaxColorOps];
  const float* tables;  // in the memory of whoever runs the program
  // The colors are not sRGB: operations and masks work on what `encode` makes of them.
  bool encodes = false;
  ColorOp encode = {}, decode = {};
};

// An affine map of each color, or a program, blended in by a soft mask: y + mask / 255 * (delta y +
// offset), ColorEdit with delta = gain - identity.
struct ColorMap {
  float delta[9];  // row-major
  float offset[3];
  // In the memory of the backend. If not null, the result is y + mask / 255 * (f(y) - y), f the
  // program.
  const ColorProgram* program = nullptr;
};

// One of `size` colors from black to white, linearly between; `lightness` in [0, 1].
RETINT_HD void GradientAt(const float* table, int size, float lightness, float* color) {
  const float at = lightness * float(size - 1);
  const int low = int(at) < size - 2 ? int(at) : size - 2;
  const float t = at - float(low);
  for (int c = 0; c < 3; ++c) {
    color[c] = (1 - t) * table[3 * low + c] + t * table[3 * low + 3 + c];
  }
}

// Tetrahedral interpolation in a table of size^3 colors over [0, 1]^3, red fastest; colors outside
// are taken to the cube's surface first. The cube's diagonal, and with it gray, is interpolated
// along itself alone (Kasson et al. 1995).
RETINT_HD void TableColor(const float* table, int size, float* color) {
  int cell[3];
  float f[3];
  for (int c = 0; c < 3; ++c) {
    const float at = Clamp01(color[c]) * float(size - 1);
    cell[c] = int(at) < size - 2 ? int(at) : size - 2;
    f[c] = at - float(cell[c]);
  }
  // From the cell's low corner to its high one along the axes in the order of their fractions.
  const int first = f[0] >= f[1] ? (f[0] >= f[2] ? 0 : 2) : (f[1] >= f[2] ? 1 : 2);
  const int last = f[2] <= f[0] && f[2] <= f[1] && first != 2   ? 2
                   : f[1] <= f[0] && f[1] <= f[2] && first != 1 ? 1
                   : first != 0                                 ? 0
                                                                : 1;
  const int middle = 3 - first - last;
  const int64_t step[3] = {3, 3 * int64_t(size), 3 * int64_t(size) * size};
  const float* p0 = table + cell[0] * step[0] + cell[1] * step[1] + cell[2] * step[2];
  const float* p1 = p0 + step[first];
  const float* p2 = p1 + step[middle];
  const float* p3 = p2 + step[last];
  for (int c = 0; c < 3; ++c) {
    color[c] = (1 - f[first]) * p0[c] + (f[first] - f[middle]) * p1[c] +
               (f[middle] - f[last]) * p2[c] + f[last] * p3[c];
  }
}

// A curve has `size` values that never fall, evenly over [0, kCurveEnd]. It goes on straight above.
inline constexpr float kCurveEnd = 2;

RETINT_HD void CurveColor(const float* curve, int size, float* color) {
  for (int c = 0; c < 3; ++c) {
    const float at = (color[c] > 0 ? color[c] : 0) * (float(size - 1) / kCurveEnd);
    const int low = at < float(size - 2) ? int(at) : size - 2;
    color[c] = curve[low] + (at - float(low)) * (curve[low + 1] - curve[low]);
  }
}

// The least values that the curve takes to `color`; 0 for those below it.
RETINT_HD void InverseCurveColor(const float* curve, int size, float* color) {
  for (int c = 0; c < 3; ++c) {
    int low = 0, high = size - 1;
    while (high - low > 1) {
      const int middle = (low + high) / 2;
      (curve[middle] < color[c] ? low : high) = middle;
    }
    const float rise = curve[low + 1] - curve[low];
    const float t = rise > 0 ? (color[c] - curve[low]) / rise : 0;
    color[c] = (float(low) + (t > 0 ? t : 0)) * (kCurveEnd / float(size - 1));
  }
}

#include "kernels/common/color_ops-inl.h"

RETINT_HD void ApplyColorMap(const ColorMap& map, uint8_t mask, const float* color, float* edited) {
  ApplyColorMap(map, float(mask) * (1.0f / 255), color, edited);
}

}  // namespace retint
