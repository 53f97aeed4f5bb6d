// SPDX-License-Identifier: BSD-3-Clause
// Floats as whole numbers of steps, saturating.
#pragma once

#include <cmath>
#include <cstdint>

#include "kernels/common/macros.h"

namespace retint {

// Not a number stays one, which the rounding makes 0 steps of.
RETINT_HD float ClampSteps(float steps, float low, float high) {
  return steps < low ? low : high < steps ? high : steps;
}

// To the nearest step, halves to the even one, from -32768 to 32767. `steps_per_unit` is 1 / the
// size of a step.
RETINT_HD int16_t ToSignedSteps(float value, float steps_per_unit) {
  return int16_t(lrintf(ClampSteps(value * steps_per_unit, -32768.0f, 32767.0f)));
}

// The same from 0 to 65535.
RETINT_HD uint16_t ToSteps(float value, float steps_per_unit) {
  return uint16_t(lrintf(ClampSteps(value * steps_per_unit, 0.0f, 65535.0f)));
}

// A color in [0, 1] in steps of 1 / 255, halves upwards.
RETINT_HD uint8_t ColorToByte(float color) {
  return uint8_t((color < 0 ? 0.0f : 1 < color ? 1.0f : color) * 255 + 0.5f);
}

}  // namespace retint
