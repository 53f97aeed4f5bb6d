// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "selection/mask_score.h"

namespace retint {

// Of two masks that are not both empty; throws otherwise.
inline double IouOf(const Mask& mask, const Mask& truth) { return Iou(mask, truth).value(); }

}  // namespace retint
