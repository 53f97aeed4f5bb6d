// SPDX-License-Identifier: BSD-3-Clause
// One color map from pairs of colors: from a picture's change to a change of all colors.
#pragma once

#include <span>
#include <vector>

#include "recolor/lut.h"

namespace retint {

inline constexpr int kFittedTableSize = 17;  // nodes a side

// The map f that takes `before` to `after`, both [N, 3], display-encoded: a 3D table whose change
// f(c) - c minimizes
//     sum_i w_i |f(before_i) - after_i|^2 + smoothness * sum of squared second differences
//     + steadiness * sum of squared first differences,
// over its nodes. So it follows the pairs near them, and beyond them continues smoothly with the
// same change. The weights w are RobustWeights(), by iterated least squares from a smooth start. So
// pairs that contradict most others, such as lettering on a graded picture, do not count. Values
// are in [0, 1]. Needs at least one pair.
ColorTable FitColorTable(std::span<const float> before, std::span<const float> after);

// The weights of the pairs of a color map, in (0, 1], by their residuals >= 0 (Geman and McClure
// 1987): a quarter at three robust standard deviations.
std::vector<double> RobustWeights(const std::vector<double>& residuals);

}  // namespace retint
