// SPDX-License-Identifier: BSD-3-Clause
// The tile loops in plain C++: pixel by pixel as the formulas read. The SIMD ones are tested
// against these.
#include <algorithm>
#include <bit>
#include <cmath>

#include "kernels/common/blend.h"
#include "kernels/cpu/tile_kernels.h"

namespace retint {
namespace {

// visit(entry index, pixel, weight) for every pair with a weight, splat by splat.
template <typename Visit>
void ForEachWeight(const TileList& list, float* transmittance, const Visit& visit) {
  for (int64_t i = 0; i < list.count; ++i) {
    const Splat& splat = list.splats[list.entries[i]];
    for (int pixel = 0; pixel < kTilePixels; ++pixel) {
      const float dx = float(list.x0 + pixel % kTileSize) + 0.5f - splat.x;
      const float dy = float(list.y0 + pixel / kTileSize) + 0.5f - splat.y;
      const float weight = BlendStep(SplatExponent(splat, dx, dy), &transmittance[pixel]);
      if (weight > 0) visit(i, pixel, weight);
    }
  }
}

int32_t RowOf(const TileList& list, int64_t entry) {
  const int32_t splat = list.entries[entry];
  return list.splat_rows ? list.splat_rows[splat] : splat;
}

void BlendTile(const TileList& list, const float* features, int channels, float* sums,
               float* transmittance) {
  ForEachWeight(list, transmittance, [&](int64_t entry, int pixel, float weight) {
    const int32_t row = RowOf(list, entry);
    if (row < 0) return;
    for (int c = 0; c < channels; ++c) {
      sums[c * kTilePixels + pixel] += weight * features[int64_t(row) * channels + c];
    }
  });
}

void BlendTileBetween(const TileList& list, const float* features, float low, float high,
                      float* sums, float* transmittance) {
  ForEachWeight(list, transmittance, [&](int64_t entry, int pixel, float weight) {
    const int32_t row = RowOf(list, entry);
    if (row >= 0) sums[pixel] += weight * features[row];
    float& left = transmittance[pixel];
    if (left > 0 && (sums[pixel] >= high || sums[pixel] + left <= low)) left = -left;
  });
}

void TransposeTile(const TileList& list, const float* residual, int channels, float* partials,
                   float* transmittance) {
  for (int64_t i = 0; i < list.count; ++i) {
    if (list.slots[i] == kNoSlot) continue;
    std::fill_n(&partials[int64_t(list.slots[i]) * channels], channels, 0.0f);
  }
  ForEachWeight(list, transmittance, [&](int64_t entry, int pixel, float weight) {
    const uint32_t slot = list.slots[entry];
    if (slot == kNoSlot) return;
    for (int c = 0; c < channels; ++c) {
      partials[int64_t(slot) * channels + c] += weight * residual[c * kTilePixels + pixel];
    }
  });
}

void DepthTile(const TileList& list, float threshold, float* sums, float* median,
               float* transmittance) {
  ForEachWeight(list, transmittance, [&](int64_t entry, int pixel, float weight) {
    const float depth = list.splats[list.entries[entry]].depth;
    sums[pixel] += weight * depth;
    if (median && transmittance[pixel] < threshold && median[pixel] == 0) median[pixel] = depth;
  });
}

// Appends one entry's weights [kTilePixels] in compact form; nothing when all are zero.
void AppendWeights(int32_t row, const float* weights, WeightTile* tile) {
  const float largest = *std::max_element(weights, weights + kTilePixels);
  if (largest <= 0) return;
  WeightEntry entry{row, 0, kNoSlot, largest / 65535};
  for (int half = 0; half < 32; ++half) {
    const float* from = weights + 8 * half;
    if (std::all_of(from, from + 8, [](float w) { return w == 0; })) continue;
    entry.half_rows |= 1u << half;
    for (int i = 0; i < 8; ++i) {
      tile->weights.push_back(uint16_t(std::lrint(from[i] / entry.scale)));
    }
  }
  tile->entries.push_back(entry);
}

void WeightsOfTile(const TileList& list, const float* colors, WeightTile* tile, float* sums,
                   float* transmittance) {
  float weights[kTilePixels] = {};
  int64_t current = -1;
  const auto flush = [&] {
    if (current < 0) return;
    AppendWeights(RowOf(list, current), weights, tile);
    std::fill_n(weights, kTilePixels, 0.0f);
    current = -1;
  };
  ForEachWeight(list, transmittance, [&](int64_t entry, int pixel, float weight) {
    for (int c = 0; colors && c < 3; ++c) {
      sums[c * kTilePixels + pixel] += weight * colors[int64_t(list.entries[entry]) * 3 + c];
    }
    if (RowOf(list, entry) < 0) return;
    if (entry != current) flush();
    current = entry;
    weights[pixel] = weight;
  });
  flush();
}

// visit(entry, pixel, weight) for every stored weight.
template <typename Step, typename Visit>
void ForEachStored(const WeightTile& tile, const Step* weights, const Visit& visit) {
  for (const WeightEntry& entry : tile.entries) {
    for (int half = 0; half < 32; ++half) {
      if (!(entry.half_rows >> half & 1)) continue;
      for (int i = 0; i < 8; ++i) visit(entry, 8 * half + i, float(weights[i]));
      weights += 8;
    }
  }
}

template <typename Visit>
void ForEachStored(const WeightTile& tile, const Visit& visit) {
  if (tile.compact.empty()) {
    ForEachStored(tile, tile.weights.data(), visit);
  } else {
    ForEachStored(tile, tile.compact.data(), visit);
  }
}

// body(entry, half row, its 8 steps) for the half rows of a tile.
template <typename Step, typename Body>
void ForEachHalfRow(const WeightTile& tile, const Step* steps, const Body& body) {
  for (const WeightEntry& entry : tile.entries) {
    for (uint32_t left = entry.half_rows; left != 0; left &= left - 1, steps += 8) {
      body(entry, std::countr_zero(left), steps);
    }
  }
}

template <typename Step>
void CompactFrom(const WeightTile& tile, const Step* steps, float min_weight, uint32_t half_rows,
                 WeightTile* compact) {
  *compact = {};
  const auto is_kept = [&](const WeightEntry& entry, int half, const Step* from) {
    return float(*std::max_element(from, from + 8)) >= min_weight / entry.scale &&
           (half_rows >> half & 1);
  };
  float kept[kTilePixels] = {}, dropped[kTilePixels] = {};
  ForEachHalfRow(tile, steps, [&](const WeightEntry& entry, int half, const Step* from) {
    float* to = is_kept(entry, half, from) ? kept : dropped;
    for (int i = 0; i < 8; ++i) to[8 * half + i] += float(from[i]) * entry.scale;
  });
  float factor[kTilePixels], largest_sum = 0;
  for (int p = 0; p < kTilePixels; ++p) {
    largest_sum = std::max(largest_sum, kept[p] + dropped[p]);
    factor[p] = std::min((kept[p] + dropped[p]) / std::max(kept[p], 1e-12f), kMostTakenOver);
  }
  if (largest_sum < kFaint) return;
  const WeightEntry* of = nullptr;
  ForEachHalfRow(tile, steps, [&](const WeightEntry& entry, int half, const Step* from) {
    if (!is_kept(entry, half, from)) return;
    if (of != &entry) compact->entries.push_back({entry.row, 0, kNoSlot, 0});
    of = &entry;
    WeightEntry& out = compact->entries.back();
    out.half_rows |= 1u << half;
    for (int i = 0; i < 8; ++i) {
      out.scale = std::max(out.scale, float(from[i]) * factor[8 * half + i] * (entry.scale / 255));
    }
  });
  of = nullptr;
  size_t at = 0;
  ForEachHalfRow(tile, steps, [&](const WeightEntry& entry, int half, const Step* from) {
    if (!is_kept(entry, half, from)) return;
    if (of && of != &entry) ++at;
    of = &entry;
    const float inverse = entry.scale / compact->entries[at].scale;
    for (int i = 0; i < 8; ++i) {
      const float rounded = std::nearbyint(float(from[i]) * factor[8 * half + i] * inverse);
      compact->compact.push_back(uint8_t(std::min(rounded, 255.0f)));
    }
  });
}

void FindLargeHalfRows(const WeightTile& tile, float min_weight, uint32_t* half_rows) {
  float sums[kTilePixels] = {};
  std::fill_n(half_rows, tile.entries.size(), 0u);
  ForEachHalfRow(tile, tile.weights.data(),
                 [&](const WeightEntry& entry, int half, const uint16_t* from) {
                   if (float(*std::max_element(from, from + 8)) >= min_weight / entry.scale) {
                     half_rows[&entry - tile.entries.data()] |= 1u << half;
                   }
                   for (int i = 0; i < 8; ++i) sums[8 * half + i] += float(from[i]) * entry.scale;
                 });
  if (*std::max_element(sums, sums + kTilePixels) >= kFaint) return;
  std::fill_n(half_rows, tile.entries.size(), 0u);
}

void CompactTile(const WeightTile& tile, float min_weight, uint32_t half_rows,
                 WeightTile* compact) {
  if (tile.compact.empty()) {
    CompactFrom(tile, tile.weights.data(), min_weight, half_rows, compact);
  } else {
    CompactFrom(tile, tile.compact.data(), min_weight, half_rows, compact);
  }
}

void BlendWeights(const WeightTile& tile, const float* features, int channels, float* sums) {
  ForEachStored(tile, [&](const WeightEntry& entry, int pixel, float weight) {
    for (int c = 0; c < channels; ++c) {
      sums[c * kTilePixels + pixel] +=
          weight * (entry.scale * features[int64_t(entry.row) * channels + c]);
    }
  });
}

void TransposeWeights(const WeightTile& tile, const float* residual, int channels,
                      float* partials) {
  for (const WeightEntry& entry : tile.entries) {
    std::fill_n(&partials[int64_t(entry.slot) * channels], channels, 0.0f);
  }
  ForEachStored(tile, [&](const WeightEntry& entry, int pixel, float weight) {
    for (int c = 0; c < channels; ++c) {
      partials[int64_t(entry.slot) * channels + c] +=
          entry.scale * weight * residual[c * kTilePixels + pixel];
    }
  });
}

double Residual(const int16_t* target, float unit, const uint8_t* weights, int row_step,
                const StayLoss& stay, float* sums) {
  double loss = 0;
  for (int i = 0; i < kTilePixels / row_step; ++i) {
    const int p = i / kTileSize * row_step * kTileSize + i % kTileSize;
    const float weight = float(weights[i]) * (1.0f / 255);
    const float slope = SlopeAt(stay, target + 3 * i);
    for (int c = 0; c < 3; ++c) {
      float& sum = sums[c * kTilePixels + p];
      const float r = float(target[3 * i + c]) * unit - sum;
      const ResidualCost cost = CostOf(r, slope, stay.bend);
      sum = weight * cost.curvature * r;
      loss += double(weight * cost.value);
    }
  }
  return loss;
}

}  // namespace

const TileKernels& ScalarTileKernels() {
  static constexpr TileKernels kKernels = {
      BlendTile,         BlendTileBetween, TransposeTile, DepthTile,        WeightsOfTile,
      FindLargeHalfRows, CompactTile,      BlendWeights,  TransposeWeights, Residual};
  return kKernels;
}

}  // namespace retint
