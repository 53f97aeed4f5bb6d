// SPDX-License-Identifier: BSD-3-Clause
// The light of a scene, from something in it that is known to be gray.
#pragma once

#include <span>
#include <string>

namespace retint {

// Of a ColorOperationKind::kWhiteBalance.
struct GrayBalance {
  float temperature = 0, tint = 0;
  std::string warning;  // where their range ends before the color is gray, a sentence; else empty
};

// The balance that takes most chroma from `color`, 3 values from 0 to 1, display-encoded.
GrayBalance WhiteBalanceOfGray(std::span<const float> color);

}  // namespace retint
