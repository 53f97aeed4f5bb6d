// SPDX-License-Identifier: BSD-3-Clause
// The rules by which BlendOps::Restrict() leaves out weights of a region. All backends choose by
// the same counts, so that they fit the same pixels.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace retint {

// Pixel rows of a tile that are kept (bit y), and the least weight in units of the one asked for.
struct Thinning {
  uint16_t pixel_rows;
  float min_weight;
};
inline constexpr Thinning kThinnings[] = {{0xffff, 1}, {0x5555, 1}, {0x1111, 1},
                                          {0x0101, 1}, {0x0101, 2}, {0x0101, 4}};
inline constexpr size_t kNumThinnings = sizeof(kThinnings) / sizeof(kThinnings[0]);
inline constexpr size_t kNumRowThinnings = 4;  // the first, which differ in their rows alone

// Weights left out are taken over by the pixel's others, up to this many times their own.
inline constexpr float kMostTakenOver = 4;
// A tile is no part of the region when no pixel's active weights sum to more: the edit is smaller
// there than a step of 8 bits.
inline constexpr float kFaint = 4.0f / 255;

// Every so many tiles one is looked at before a thinning is chosen.
inline constexpr int kThinningStride = 16;

// The most bytes that the weights need. A quarter is an 8x8 part of a tile with weights of one
// Gaussian: 16 bytes, and 8 for each of its pixel rows.
inline uint64_t ThinnedBytes(const Thinning& thinning, uint64_t quarters) {
  return quarters * (16 + 4 * uint64_t(std::popcount(thinning.pixel_rows)));
}

// So many bytes of weights a Gaussian and view are enough, with 48 unknowns and many views: the
// work shall go with the Gaussians, not with their pixels.
inline constexpr size_t kEnoughBytesPerRow = 512;

// The first thinning of rows that promises to keep no more than enough and to fit, or the last of
// them. `quarters` has the counts of each in `samples` of the region's `tiles`.
inline size_t ChooseRowThinning(const uint64_t* quarters, size_t samples, size_t tiles, size_t rows,
                                size_t budget_bytes) {
  const size_t most = std::min(kEnoughBytesPerRow * rows, budget_bytes);
  size_t level = 0;
  while (level + 1 < kNumRowThinnings &&
         ThinnedBytes(kThinnings[level], quarters[level]) * tiles / std::max<size_t>(samples, 1) >
             most) {
    ++level;
  }
  return level;
}

}  // namespace retint
