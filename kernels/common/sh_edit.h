// SPDX-License-Identifier: BSD-3-Clause
// The effect of a color edit on one Gaussian's spherical harmonics.
#pragma once

#include "kernels/common/color_ops.h"
#include "kernels/common/macros.h"
#include "kernels/common/sh.h"

namespace retint {

// An affine map y + share (delta y + offset) of a color 0.5 + sum_k Y_k C_k maps each coefficient
// exactly, for every direction: C_k + share delta C_k. Only the constant term also changes by delta
// 0.5 + offset. `value` [3] is coefficient k.
RETINT_HD void EditCoefficient(const ColorMap& map, float share, int k, float* value) {
  float change[3];
  for (int c = 0; c < 3; ++c) {
    const float* row = map.delta + 3 * c;
    change[c] = row[0] * value[0] + (row[1] * value[1] + row[2] * value[2]);
    if (k == 0) change[c] += (0.5f * (row[0] + (row[1] + row[2])) + map.offset[c]) / kShC0;
  }
  for (int c = 0; c < 3; ++c) {
    // Adding 0 would turn -0 into 0: an identity edit changes no bit.
    if (change[c] != 0) value[c] += share * change[c];
  }
}

// The change of a color, which may be negative, that makes its visible part, max(0, color), change
// by `wanted`: a negative color must first rise to 0. `share` is the edit's.
RETINT_HD float ChangeToShow(float wanted, float share, float color) {
  return wanted > 0 && color < 0 ? wanted - share * color : wanted;
}

}  // namespace retint
