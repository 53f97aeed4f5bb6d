// SPDX-License-Identifier: BSD-3-Clause
// The tile loops over explicit weights in Highway: a part of tile_kernels_simd.cc, compiled once a
// target.
#if defined(RETINT_WEIGHTS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef RETINT_WEIGHTS_INL_H_
#undef RETINT_WEIGHTS_INL_H_
#else
#define RETINT_WEIGHTS_INL_H_
#endif

#include <algorithm>
#include <cstddef>
#include <type_traits>
#include <vector>

#include <hwy/highway.h>

#include "kernels/cpu/tile_kernels.h"

HWY_BEFORE_NAMESPACE();
namespace retint {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using HalfTag = hn::CappedTag<float, 8>;

// Calls body with `channels` as a compile-time constant.
template <class Body>
HWY_INLINE void WithChannels(int channels, const Body& body) {
  static_assert(kMaxChannels == 8);
  switch (channels) {
    case 1:
      return body(std::integral_constant<int, 1>());
    case 2:
      return body(std::integral_constant<int, 2>());
    case 3:
      return body(std::integral_constant<int, 3>());
    case 4:
      return body(std::integral_constant<int, 4>());
    case 5:
      return body(std::integral_constant<int, 5>());
    case 6:
      return body(std::integral_constant<int, 6>());
    case 7:
      return body(std::integral_constant<int, 7>());
    default:
      return body(std::integral_constant<int, 8>());
  }
}

// Appends one entry's weights (rows outside `touched` are zero, whatever `weights` holds).
HWY_INLINE void AppendEntry(int32_t row, const float* HWY_RESTRICT weights, uint32_t touched,
                            WeightTile* tile) {
  const HalfTag d;
  const hn::Rebind<uint16_t, HalfTag> d16;
  const hn::RebindToSigned<HalfTag> di;
  hn::Vec<HalfTag> largest = hn::Zero(d);
  for (int half = 0; half < 32; ++half) {
    if (!(touched >> (half / 2) & 1)) continue;
    for (size_t x = 0; x < 8; x += hn::Lanes(d)) {
      largest = hn::Max(largest, hn::Load(d, weights + 8 * half + int(x)));
    }
  }
  const float peak = hn::GetLane(hn::MaxOfLanes(d, largest));
  if (!(peak > 0)) return;
  WeightEntry entry{row, 0, kNoSlot, peak / 65535};
  const auto inverse = hn::Set(d, 65535 / peak);
  size_t size = tile->weights.size();
  tile->weights.resize(size + kTilePixels);
  for (int half = 0; half < 32; ++half) {
    if (!(touched >> (half / 2) & 1)) continue;
    uint16_t* out = tile->weights.data() + size;
    bool any = false;
    for (size_t x = 0; x < 8; x += hn::Lanes(d)) {
      const auto steps = hn::NearestInt(hn::Mul(hn::Load(d, weights + 8 * half + int(x)), inverse));
      any = any || !hn::AllTrue(di, hn::Eq(steps, hn::Zero(di)));
      hn::StoreU(hn::DemoteTo(d16, steps), d16, out + x);
    }
    if (!any) continue;
    entry.half_rows |= 1u << half;
    size += 8;
  }
  tile->weights.resize(size);
  tile->entries.push_back(entry);
}

// Which half rows of an entry hold a weight of `threshold` steps or more.
template <class Step>
HWY_INLINE uint32_t LargeHalfRows(uint32_t half_rows, const Step* steps, float threshold) {
  const HalfTag d;
  const hn::Rebind<Step, HalfTag> ds;
  const hn::RebindToSigned<HalfTag> di;
  const auto limit = hn::Set(d, threshold);
  uint32_t large = 0;
  for (uint32_t left = half_rows; left != 0; left &= left - 1, steps += 8) {
    bool any = false;
    for (size_t x = 0; x < 8; x += hn::Lanes(d)) {
      const auto weight = hn::ConvertTo(d, hn::PromoteTo(di, hn::LoadU(ds, steps + x)));
      any = any || !hn::AllFalse(d, hn::Ge(weight, limit));
    }
    if (any) large |= left & (0 - left);
  }
  return large;
}

// visit(offset of the half row's vector in the tile, weights in steps) for an entry's weights.
template <class Step, class Visit>
HWY_INLINE const Step* VisitWeights(const WeightEntry& entry, const Step* weights,
                                    const Visit& visit) {
  const HalfTag d;
  const hn::Rebind<Step, HalfTag> ds;
  const hn::RebindToSigned<HalfTag> di;
  for (uint32_t left = entry.half_rows; left != 0; left &= left - 1, weights += 8) {
    const size_t half = hwy::Num0BitsBelowLS1Bit_Nonzero32(left);
    for (size_t x = 0; x < 8; x += hn::Lanes(d)) {
      const auto steps = hn::PromoteTo(di, hn::LoadU(ds, weights + x));
      visit(8 * half + x, hn::ConvertTo(d, steps));
    }
  }
  return weights;
}

void FindLargeHalfRows(const WeightTile& tile, float min_weight, uint32_t* half_rows) {
  const HalfTag d;
  HWY_ALIGN float sums[kTilePixels] = {};
  const uint16_t* steps = tile.weights.data();
  for (const WeightEntry& entry : tile.entries) {
    *half_rows++ = LargeHalfRows(entry.half_rows, steps, min_weight / entry.scale);
    const auto scale = hn::Set(d, entry.scale);
    steps = VisitWeights(entry, steps, [&](size_t at, hn::Vec<HalfTag> weight) HWY_ATTR {
      hn::Store(hn::MulAdd(weight, scale, hn::Load(d, sums + at)), d, sums + at);
    });
  }
  auto largest_sum = hn::Zero(d);
  for (size_t p = 0; p < kTilePixels; p += hn::Lanes(d)) {
    largest_sum = hn::Max(largest_sum, hn::Load(d, sums + p));
  }
  if (hn::GetLane(hn::MaxOfLanes(d, largest_sum)) >= kFaint) return;
  std::fill_n(half_rows - tile.entries.size(), tile.entries.size(), 0u);
}

template <class Step>
void CompactFrom(const WeightTile& tile, const Step* const all_steps, float min_weight,
                 uint32_t half_rows, WeightTile* compact) {
  const HalfTag d;
  const hn::Rebind<Step, HalfTag> ds;
  const hn::RebindToSigned<HalfTag> di;
  const hn::Rebind<uint8_t, HalfTag> d8;
  HWY_ALIGN float kept[kTilePixels] = {};
  HWY_ALIGN float dropped[kTilePixels] = {};
  // body(half, steps of its 8 weights)
  const auto for_each_half = [&](uint32_t left, const Step* steps, const auto& body) HWY_ATTR {
    for (; left != 0; left &= left - 1, steps += 8) {
      body(hwy::Num0BitsBelowLS1Bit_Nonzero32(left), steps);
    }
  };
  const auto load = [&](const Step* steps) HWY_ATTR {
    return hn::ConvertTo(d, hn::PromoteTo(di, hn::LoadU(ds, steps)));
  };

  std::vector<uint32_t> keep(tile.entries.size());
  size_t num_entries = 0, num_halves = 0;
  const Step* steps = all_steps;
  for (size_t e = 0; e < keep.size(); ++e) {
    const WeightEntry& entry = tile.entries[e];
    const auto scale = hn::Set(d, entry.scale);
    keep[e] = half_rows & LargeHalfRows(entry.half_rows, steps, min_weight / entry.scale);
    num_entries += keep[e] != 0;
    num_halves += hwy::PopCount(keep[e]);
    for_each_half(entry.half_rows, steps, [&](size_t half, const Step* from) HWY_ATTR {
      float* to = (keep[e] >> half & 1 ? kept : dropped) + 8 * half;
      for (size_t x = 0; x < 8; x += hn::Lanes(d)) {
        hn::Store(hn::MulAdd(load(from + x), scale, hn::Load(d, to + x)), d, to + x);
      }
    });
    steps += 8 * hwy::PopCount(entry.half_rows);
  }
  float* const factor = dropped;
  auto largest_sum = hn::Zero(d);
  for (size_t p = 0; p < kTilePixels; p += hn::Lanes(d)) {
    const auto own = hn::Load(d, kept + p), sum = hn::Add(own, hn::Load(d, dropped + p));
    largest_sum = hn::Max(largest_sum, sum);
    const auto grown = hn::Div(sum, hn::Max(own, hn::Set(d, 1e-12f)));
    hn::Store(hn::Min(grown, hn::Set(d, kMostTakenOver)), d, factor + p);
  }

  *compact = {};
  if (hn::GetLane(hn::MaxOfLanes(d, largest_sum)) < kFaint) return;
  compact->entries.reserve(num_entries);
  compact->compact.resize(8 * num_halves);
  uint8_t* out = compact->compact.data();
  steps = all_steps;
  for (size_t e = 0; e < keep.size(); ++e) {
    const WeightEntry& entry = tile.entries[e];
    const Step* const first = steps;
    steps += 8 * hwy::PopCount(entry.half_rows);
    if (keep[e] == 0) continue;
    auto largest = hn::Zero(d);
    for_each_half(entry.half_rows, first, [&](size_t half, const Step* from) HWY_ATTR {
      if (!(keep[e] >> half & 1)) return;
      for (size_t x = 0; x < 8; x += hn::Lanes(d)) {
        largest = hn::Max(largest, hn::Mul(load(from + x), hn::Load(d, factor + 8 * half + x)));
      }
    });
    const float peak = hn::GetLane(hn::MaxOfLanes(d, largest));
    const auto inverse = hn::Set(d, 255 / peak);
    for_each_half(entry.half_rows, first, [&](size_t half, const Step* from) HWY_ATTR {
      if (!(keep[e] >> half & 1)) return;
      for (size_t x = 0; x < 8; x += hn::Lanes(d), out += hn::Lanes(d)) {
        const auto weight = hn::Mul(load(from + x), hn::Load(d, factor + 8 * half + x));
        hn::StoreU(hn::DemoteTo(d8, hn::NearestInt(hn::Mul(weight, inverse))), d8, out);
      }
    });
    compact->entries.push_back({entry.row, keep[e], kNoSlot, entry.scale * peak / 255});
  }
}

void CompactTile(const WeightTile& tile, float min_weight, uint32_t half_rows,
                 WeightTile* compact) {
  if (tile.compact.empty()) {
    CompactFrom(tile, tile.weights.data(), min_weight, half_rows, compact);
  } else {
    CompactFrom(tile, tile.compact.data(), min_weight, half_rows, compact);
  }
}

double Residual(const int16_t* target, float unit, const uint8_t* weights, int row_step,
                const StayLoss& stay, float* sums) {
  const HalfTag d;
  const hn::Rebind<int16_t, HalfTag> d16;
  const hn::Rebind<uint8_t, HalfTag> d8;
  const hn::RebindToSigned<HalfTag> di;
  const auto scale = hn::Set(d, unit), step = hn::Set(d, 1.0f / 255);
  const auto one = hn::Set(d, 1.0f), slope = hn::Set(d, stay.slope), bend = hn::Set(d, stay.bend);
  auto loss = hn::Zero(d);
  size_t i = 0;
  for (int y = 0; y < kTileSize; y += row_step) {
    for (size_t x = 0; x < size_t(kTileSize); x += hn::Lanes(d), i += hn::Lanes(d)) {
      const size_t p = size_t(y) * kTileSize + x;
      hn::Vec<decltype(d16)> wanted[3];
      hn::LoadInterleaved3(d16, target + 3 * i, wanted[0], wanted[1], wanted[2]);
      const auto weight =
          hn::Mul(hn::ConvertTo(d, hn::PromoteTo(di, hn::LoadU(d8, weights + i))), step);
      const auto any = hn::PromoteTo(di, hn::Or(hn::Or(wanted[0], wanted[1]), wanted[2]));
      const auto stays = hn::RebindMask(d, hn::Eq(any, hn::Zero(di)));
      const bool counts = stay.slope > 0 && !hn::AllFalse(d, stays);
      const auto of_pixel = hn::IfThenElseZero(stays, slope);
      for (size_t c = 0; c < 3; ++c) {
        float* const at = sums + c * kTilePixels + p;
        const auto goal = hn::ConvertTo(d, hn::PromoteTo(di, wanted[c]));
        const auto r = hn::MulSub(goal, scale, hn::Load(d, at));
        auto half_slope = hn::Mul(weight, r);
        loss = hn::MulAdd(half_slope, r, loss);
        if (counts) {
          const auto root = hn::Sqrt(hn::MulAdd(r, r, hn::Mul(bend, bend)));
          const auto twice = hn::Mul(hn::Set(d, 2.0f), hn::Mul(weight, of_pixel));
          loss = hn::MulAdd(twice, hn::Sub(root, bend), loss);
          half_slope = hn::Mul(half_slope, hn::Add(one, hn::Div(of_pixel, root)));
        }
        hn::Store(half_slope, d, at);
      }
    }
  }
  return double(hn::GetLane(hn::SumOfLanes(d, loss)));
}

template <int C, class Step>
void BlendWeightsC(const WeightTile& tile, const Step* weights, const float* HWY_RESTRICT features,
                   float* HWY_RESTRICT sums) {
  const HalfTag d;
  for (const WeightEntry& entry : tile.entries) {
    hn::Vec<HalfTag> feature[C];
    for (int c = 0; c < C; ++c) {
      feature[c] = hn::Set(d, entry.scale * features[int64_t(entry.row) * C + c]);
    }
    weights = VisitWeights(entry, weights, [&](size_t at, hn::Vec<HalfTag> weight) HWY_ATTR {
      float* out = sums + at;
      for (int c = 0; c < C; ++c, out += kTilePixels) {
        hn::Store(hn::MulAdd(weight, feature[c], hn::Load(d, out)), d, out);
      }
    });
  }
}

template <int C, class Step>
void TransposeWeightsC(const WeightTile& tile, const Step* weights,
                       const float* HWY_RESTRICT residual, float* HWY_RESTRICT partials) {
  const HalfTag d;
  for (const WeightEntry& entry : tile.entries) {
    hn::Vec<HalfTag> sum[C];
    for (int c = 0; c < C; ++c) sum[c] = hn::Zero(d);
    weights = VisitWeights(entry, weights, [&](size_t at, hn::Vec<HalfTag> weight) HWY_ATTR {
      const float* in = residual + at;
      for (int c = 0; c < C; ++c, in += kTilePixels) {
        sum[c] = hn::MulAdd(weight, hn::Load(d, in), sum[c]);
      }
    });
    float* out = partials + int64_t(entry.slot) * C;
    for (int c = 0; c < C; ++c) out[c] = entry.scale * hn::GetLane(hn::SumOfLanes(d, sum[c]));
  }
}

void BlendWeights(const WeightTile& tile, const float* features, int channels, float* sums) {
  WithChannels(channels, [&](auto c) HWY_ATTR {
    constexpr int kChannels = decltype(c)::value;
    if (tile.compact.empty()) {
      BlendWeightsC<kChannels>(tile, tile.weights.data(), features, sums);
    } else {
      BlendWeightsC<kChannels>(tile, tile.compact.data(), features, sums);
    }
  });
}

void TransposeWeights(const WeightTile& tile, const float* residual, int channels,
                      float* partials) {
  WithChannels(channels, [&](auto c) HWY_ATTR {
    constexpr int kChannels = decltype(c)::value;
    if (tile.compact.empty()) {
      TransposeWeightsC<kChannels>(tile, tile.weights.data(), residual, partials);
    } else {
      TransposeWeightsC<kChannels>(tile, tile.compact.data(), residual, partials);
    }
  });
}

}  // namespace HWY_NAMESPACE
}  // namespace retint
HWY_AFTER_NAMESPACE();

#endif
