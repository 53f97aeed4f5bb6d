// SPDX-License-Identifier: BSD-3-Clause
// Edits of many colors in host memory.
#pragma once

#include <cstdint>

#include "kernels/common/color_ops.h"

namespace retint {

// ApplyColorMap() for `count` colors, [count, 3], with a mask value each, [count], or with 255
// where `mask` is null. `edited` may be `colors`. Several colors at a time, with powers that differ
// from those of <cmath> by 1e-6 at most, relatively.
void EditColors(const ColorMap& map, const uint8_t* mask, const float* colors, int64_t count,
                float* edited);
// The same one by one: the oracle.
void EditColorsOneByOne(const ColorMap& map, const uint8_t* mask, const float* colors,
                        int64_t count, float* edited);
using EditColorsKernel = decltype(&EditColors);

}  // namespace retint
