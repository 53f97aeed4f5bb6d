// SPDX-License-Identifier: BSD-3-Clause
// The closed form as coefficients of their own.
#pragma once

#include <span>

#include "recolor/sh_refitter.h"

namespace retint {

inline FloatArray ClosedFormSh(Backend& backend, std::span<const float> sh, int num_coeffs,
                               std::span<const float> shares, const ColorEdit& edit,
                               double active_threshold = RefitOptions().active_threshold) {
  FloatArray edited(sh.begin(), sh.end());
  ApplyClosedForm(backend, edited, num_coeffs, shares, edit, active_threshold);
  return edited;
}

}  // namespace retint
