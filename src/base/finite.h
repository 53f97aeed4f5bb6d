// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <bit>
#include <cstdint>
#include <span>

namespace retint {

// Whether no value is NaN or infinite. Without a branch, so that it vectorizes.
inline bool AllFinite(std::span<const float> values) {
  constexpr uint32_t kExponent =
      0x7f800000u;  // all of its bits are set in numbers that are not finite
  uint32_t any = 0;
  for (const float value : values) {
    any |= (std::bit_cast<uint32_t>(value) & kExponent) == kExponent ? 1u : 0u;
  }
  return any == 0;
}

}  // namespace retint
