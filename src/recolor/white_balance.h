// SPDX-License-Identifier: BSD-3-Clause
// The light of a scene, from something in it that is known to be gray.
#pragma once

#include <array>
#include <span>

namespace retint {

// Temperature and tint of the white balance (ColorOperationKind::kWhiteBalance) that takes most
// chroma from `color`, 3 values, display-encoded: gray, as far as their range reaches.
std::array<float, 2> WhiteBalanceOfGray(std::span<const float> color);

}  // namespace retint
