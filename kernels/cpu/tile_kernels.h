// SPDX-License-Identifier: BSD-3-Clause
// The inner loops: everything that happens between one tile's list and its 16 x 16 pixels. Once in
// scalar C++ (the oracle), once in Highway with run-time dispatch; the rest of the backend is
// shared.
#pragma once

#include <cstdint>

#include "kernels/common/loss.h"
#include "kernels/common/projection.h"
#include "kernels/common/thinning.h"
#include "kernels/cpu/geometry.h"

namespace retint {

// One tile's list. Planar per-tile images are [C][kTilePixels], row-major inside the tile.
struct TileList {
  const Splat* splats;
  const int32_t* entries;     // [count] index into splats
  const int32_t* splat_rows;  // null: identity
  const uint32_t* slots;      // [count], of the transpose
  int64_t count;
  int x0, y0;  // the tile's first pixel
};

struct TileKernels {
  // sums += W c. `transmittance` holds 1, or -1 for pixels beyond the image, on entry; |T| is the
  // final transmittance afterwards.
  void (*blend)(const TileList& list, const float* features, int channels, float* sums,
                float* transmittance);
  // The same for one channel with features in [0, 1] between the limits of BlendParams; then the
  // transmittance is of no meaning.
  void (*blend_between)(const TileList& list, const float* features, float low, float high,
                        float* sums, float* transmittance);
  // partials[slot, C] = sum over the tile's pixels of W * residual, for every entry with a slot.
  void (*transpose)(const TileList& list, const float* residual, int channels, float* partials,
                    float* transmittance);
  // sums += W z; median, if not null, = z of the splat at which T falls below `threshold`.
  void (*depth)(const TileList& list, float threshold, float* sums, float* median,
                float* transmittance);
  // Explicit weights of the active entries that have any; slot is left kNoSlot. If `colors`
  // [splats, 3] is not null, also sums += W colors, over all entries.
  void (*weights)(const TileList& list, const float* colors, WeightTile* tile, float* sums,
                  float* transmittance);
  // half_rows[entry] = those with a weight of `min_weight` or more; none in a tile in which no
  // pixel's weights sum to kFaint.
  void (*large_half_rows)(const WeightTile& tile, float min_weight, uint32_t* half_rows);
  // compact = tile's half rows that are in `half_rows` and have a weight of `min_weight` or more,
  // stored in 8 bits, relative to each entry's largest. They grow, up to kMostTakenOver times, to
  // replace the weights left out in their pixels, so that the pixels' sums stay the same. `compact`
  // must not be `tile`.
  void (*compact)(const WeightTile& tile, float min_weight, uint32_t half_rows,
                  WeightTile* compact);
  // blend and transpose from explicit weights.
  void (*blend_weights)(const WeightTile& tile, const float* features, int channels, float* sums);
  void (*transpose_weights)(const WeightTile& tile, const float* residual, int channels,
                            float* partials);
  // sums = weights / 255 (target unit - sums), three channels, in every `row_step`-th pixel row.
  // Returns the sum of weights / 255 (target unit - sums)^2, plus the cost of `stay`. `target`
  // [rows, kTileSize, 3] and `weights` [rows, kTileSize] have only these rows.
  double (*residual)(const int16_t* target, float unit, const uint8_t* weights, int row_step,
                     const StayLoss& stay, float* sums);
};

const TileKernels& ScalarTileKernels();
const TileKernels& SimdTileKernels();
const char* SimdTargetName();  // "AVX3", "AVX2", ...

}  // namespace retint
