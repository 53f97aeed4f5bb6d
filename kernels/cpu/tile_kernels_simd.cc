// SPDX-License-Identifier: BSD-3-Clause
// The tile loops in Highway, compiled once a target and chosen at run time. A tile's row is one or
// more vectors; a splat visits only the rows that its ellipse reaches, and the exponent is compared
// before it is raised, so that most vectors cost a few instructions.
#include <cstddef>
#include <type_traits>

#include <hwy/cache_control.h>

#include "kernels/common/blend.h"
#include "kernels/cpu/tile_kernels.h"

// Vectors are kept in arrays, which targets of unknown width do not allow; SSSE3 gains nothing.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/cpu/tile_kernels_simd.cc"
#include <hwy/foreach_target.h>
// After foreach_target.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace retint {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using RowTag = hn::CappedTag<float, kTileSize>;
using HalfTag = hn::CappedTag<float, 8>;
using Row = hn::Vec<RowTag>;

// 2^e for e in [log2(1 / 255), 0], relative error below 2e-6; garbage, but no trap, outside.
// Chebyshev interpolation of 2^(e / 8), raised to the eighth power: cheaper than splitting off the
// integer part.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V Exp2(D d, V e) {
  V p = hn::Set(d, 2.88963928e-08f);
  p = hn::MulAdd(p, e, hn::Set(d, 2.24833502e-06f));
  p = hn::MulAdd(p, e, hn::Set(d, 0.00010800414f));
  p = hn::MulAdd(p, e, hn::Set(d, 0.00375279621f));
  p = hn::MulAdd(p, e, hn::Set(d, 0.0866428912f));
  p = hn::MulAdd(p, e, hn::Set(d, 0.99999994f));
  p = hn::Mul(p, p);
  p = hn::Mul(p, p);
  return hn::Mul(p, p);
}

// The rows [first, last] of a tile that a splat may reach.
struct RowRange {
  int first, last;
};

HWY_INLINE RowRange RowsOf(const Splat& splat, int y0) {
  const float center = splat.y - float(y0) - 0.5f;
  const float top = center - splat.half_height, bottom = center + splat.half_height;
  RowRange rows;
  rows.first = top <= 0 ? 0 : top >= kTileSize ? kTileSize : int(top);
  rows.last = bottom >= kTileSize - 1 ? kTileSize - 1 : bottom < 0 ? -1 : int(bottom);
  return rows;
}

// Bit y is set while row y of the tile has a live pixel.
HWY_INLINE uint32_t LiveRows(const float* transmittance) {
  const RowTag d;
  uint32_t live = 0;
  for (int y = 0; y < kTileSize; ++y) {
    for (size_t x = 0; x < kTileSize; x += hn::Lanes(d)) {
      const Row t = hn::Load(d, transmittance + y * kTileSize + int(x));
      if (!hn::AllTrue(d, hn::Lt(t, hn::Zero(d)))) live |= 1u << y;
    }
  }
  return live;
}

// A splat's exponent at row y and column x is bx[x] * dy[y] + (ax2[x] + cdy2[y]).
struct SplatRows {
  HWY_ALIGN float dy[kTileSize];
  HWY_ALIGN float cdy2[kTileSize];
};

HWY_INLINE void FillRows(const Splat& splat, int y0, SplatRows* rows) {
  const RowTag d;
  for (size_t y = 0; y < kTileSize; y += hn::Lanes(d)) {
    const Row dy = hn::Iota(d, float(y0 + int(y)) + 0.5f - splat.y);
    hn::Store(dy, d, rows->dy + y);
    hn::Store(hn::Mul(hn::Mul(hn::Set(d, splat.c), dy), dy), d, rows->cdy2 + y);
  }
}

// BlendStep for the vectors of a splat: hit(first pixel, weights, T before, T after) where a live
// pixel has alpha >= kMinAlpha. `live`: see LiveRows.
template <class Hit>
HWY_INLINE void VisitSplat(const Splat& splat, const TileList& list, uint32_t live,
                           float* HWY_RESTRICT transmittance, const Hit& hit) {
  const RowTag d;
  const RowRange range = RowsOf(splat, list.y0);
  SplatRows rows;
  FillRows(splat, list.y0, &rows);
  for (size_t x = 0; x < kTileSize; x += hn::Lanes(d)) {
    const Row dx = hn::Iota(d, float(list.x0 + int(x)) + 0.5f - splat.x);
    const Row bx = hn::Mul(hn::Set(d, splat.b), dx);
    const Row ax2 =
        hn::MulAdd(hn::Mul(hn::Set(d, splat.a), dx), dx, hn::Set(d, splat.log2_opacity));
    for (int y = range.first; y <= range.last; ++y) {
      if (!(live >> y & 1)) continue;
      const Row exponent =
          hn::MulAdd(bx, hn::Set(d, rows.dy[y]), hn::Add(ax2, hn::Set(d, rows.cdy2[y])));
      const size_t pixel = size_t(y) * kTileSize + x;
      const Row before = hn::Load(d, transmittance + pixel);
      const auto near =
          hn::And(hn::Ge(exponent, hn::Set(d, kLog2MinAlpha)), hn::Gt(before, hn::Zero(d)));
      if (hn::AllFalse(d, near)) continue;
      const Row alpha = hn::IfThenElseZero(near, hn::Min(hn::Set(d, kMaxAlpha), Exp2(d, exponent)));
      Row weight = hn::Mul(alpha, before);
      Row after = hn::NegMulAdd(alpha, before, before);
      const auto ends = hn::And(near, hn::Lt(after, hn::Set(d, kMinTransmittance)));
      if (HWY_UNLIKELY(!hn::AllFalse(d, ends))) {
        weight = hn::IfThenZeroElse(ends, weight);
        after = hn::IfThenElse(ends, hn::Neg(before), after);
      }
      hn::Store(after, d, transmittance + pixel);
      hit(pixel, weight, before, after);
    }
  }
}

constexpr int64_t kPrefetch = 6;  // entries ahead

// visit(entry, splat, live rows) over the list until every pixel is done; returns where it ended.
// prefetch(entry) comes some entries earlier.
template <class Visit, class Prefetch>
HWY_INLINE int64_t ForEachSplat(const TileList& list, const float* transmittance,
                                const Visit& visit, const Prefetch& prefetch) {
  uint32_t live = 0;
  for (int64_t i = 0; i < list.count; ++i) {
    if (i % 16 == 0) {
      live = LiveRows(transmittance);
      if (live == 0) return i;
    }
    // Lists jump about in memory.
    const int64_t ahead = i + kPrefetch < list.count ? i + kPrefetch : i;
    hwy::Prefetch(&list.splats[list.entries[ahead]]);
    prefetch(ahead);
    visit(i, list.splats[list.entries[i]], live);
  }
  return list.count;
}

HWY_INLINE int32_t RowIndex(const TileList& list, int64_t entry) {
  const int32_t splat = list.entries[entry];
  return list.splat_rows ? list.splat_rows[splat] : splat;
}

template <int C>
void BlendTileC(const TileList& list, const float* HWY_RESTRICT features, float* HWY_RESTRICT sums,
                float* HWY_RESTRICT transmittance) {
  const RowTag d;
  const auto visit = [&](int64_t i, const Splat& splat, uint32_t live) HWY_ATTR {
    static constexpr float kNothing[C] = {};
    const int32_t row = RowIndex(list, i);
    const float* from = row < 0 ? kNothing : features + int64_t(row) * C;
    Row feature[C];
    for (int c = 0; c < C; ++c) feature[c] = hn::Set(d, from[c]);
    VisitSplat(splat, list, live, transmittance, [&](size_t pixel, Row weight, Row, Row) HWY_ATTR {
      float* at = sums + pixel;
      for (int c = 0; c < C; ++c, at += kTilePixels) {
        hn::Store(hn::MulAdd(weight, feature[c], hn::Load(d, at)), d, at);
      }
    });
  };
  const auto prefetch = [&](int64_t i) HWY_ATTR {
    if (!list.splat_rows) hwy::Prefetch(features + int64_t(list.entries[i]) * C);
  };
  ForEachSplat(list, transmittance, visit, prefetch);
}

// A pixel is done as soon as nothing that may still come takes it from one side of a limit to the
// other.
void BlendTileBetween(const TileList& list, const float* HWY_RESTRICT features, float low,
                      float high, float* HWY_RESTRICT sums, float* HWY_RESTRICT transmittance) {
  const RowTag d;
  const Row lowest = hn::Set(d, low), highest = hn::Set(d, high);
  const auto visit = [&](int64_t i, const Splat& splat, uint32_t live) HWY_ATTR {
    const int32_t row = RowIndex(list, i);
    const Row feature = hn::Set(d, row < 0 ? 0.0f : features[row]);
    VisitSplat(
        splat, list, live, transmittance, [&](size_t pixel, Row weight, Row, Row after) HWY_ATTR {
          const Row sum = hn::MulAdd(weight, feature, hn::Load(d, sums + pixel));
          hn::Store(sum, d, sums + pixel);
          const auto settled = hn::Or(hn::Ge(sum, highest), hn::Le(hn::Add(sum, after), lowest));
          hn::Store(hn::IfThenElse(settled, hn::Neg(hn::Abs(after)), after), d,
                    transmittance + pixel);
        });
  };
  const auto prefetch = [&](int64_t i) HWY_ATTR {
    if (!list.splat_rows) hwy::Prefetch(features + list.entries[i]);
  };
  ForEachSplat(list, transmittance, visit, prefetch);
}

template <int C>
void TransposeTileC(const TileList& list, const float* HWY_RESTRICT residual,
                    float* HWY_RESTRICT partials, float* HWY_RESTRICT transmittance) {
  const RowTag d;
  const auto visit = [&](int64_t i, const Splat& splat, uint32_t live) HWY_ATTR {
    Row sum[C];
    for (int c = 0; c < C; ++c) sum[c] = hn::Zero(d);
    VisitSplat(splat, list, live, transmittance, [&](size_t pixel, Row weight, Row, Row) HWY_ATTR {
      const float* at = residual + pixel;
      for (int c = 0; c < C; ++c, at += kTilePixels) {
        sum[c] = hn::MulAdd(weight, hn::Load(d, at), sum[c]);
      }
    });
    if (list.slots[i] == kNoSlot) return;
    float* out = partials + int64_t(list.slots[i]) * C;
    for (int c = 0; c < C; ++c) out[c] = hn::GetLane(hn::SumOfLanes(d, sum[c]));
  };
  const auto prefetch = [&](int64_t i) HWY_ATTR {
    if (list.slots[i] != kNoSlot) hwy::Prefetch(partials + int64_t(list.slots[i]) * C);
  };
  for (int64_t i = ForEachSplat(list, transmittance, visit, prefetch); i < list.count; ++i) {
    if (list.slots[i] == kNoSlot) continue;
    float* out = partials + int64_t(list.slots[i]) * C;
    for (int c = 0; c < C; ++c) out[c] = 0;
  }
}

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

void BlendTile(const TileList& list, const float* features, int channels, float* sums,
               float* transmittance) {
  WithChannels(channels, [&](auto c) HWY_ATTR {
    BlendTileC<decltype(c)::value>(list, features, sums, transmittance);
  });
}

void TransposeTile(const TileList& list, const float* residual, int channels, float* partials,
                   float* transmittance) {
  WithChannels(channels, [&](auto c) HWY_ATTR {
    TransposeTileC<decltype(c)::value>(list, residual, partials, transmittance);
  });
}

template <bool kMedian>
void DepthTileOf(const TileList& list, float threshold, float* HWY_RESTRICT sums,
                 float* HWY_RESTRICT median, float* HWY_RESTRICT transmittance) {
  const RowTag d;
  const Row limit = hn::Set(d, threshold);
  const auto visit = [&](int64_t, const Splat& splat, uint32_t live) HWY_ATTR {
    const Row depth = hn::Set(d, splat.depth);
    const auto hit = [&](size_t pixel, Row weight, Row before, Row after) HWY_ATTR {
      hn::Store(hn::MulAdd(weight, depth, hn::Load(d, sums + pixel)), d, sums + pixel);
      if constexpr (kMedian) {
        const auto crosses = hn::And(hn::And(hn::Ge(before, limit), hn::Lt(after, limit)),
                                     hn::Gt(weight, hn::Zero(d)));
        const Row old = hn::Load(d, median + pixel);
        hn::Store(hn::IfThenElse(crosses, depth, old), d, median + pixel);
      }
    };
    VisitSplat(splat, list, live, transmittance, hit);
  };
  ForEachSplat(list, transmittance, visit, [](int64_t) {});
}

void DepthTile(const TileList& list, float threshold, float* sums, float* median,
               float* transmittance) {
  const auto find = median ? DepthTileOf<true> : DepthTileOf<false>;
  find(list, threshold, sums, median, transmittance);
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

void WeightsOfTile(const TileList& list, WeightTile* tile, float* HWY_RESTRICT transmittance) {
  const RowTag d;
  HWY_ALIGN float weights[kTilePixels];
  const auto visit = [&](int64_t i, const Splat& splat, uint32_t live) HWY_ATTR {
    const int32_t row = RowIndex(list, i);
    uint32_t touched = 0;
    const auto hit = [&](size_t pixel, Row weight, Row, Row) HWY_ATTR {
      if (row < 0) return;
      const size_t y = pixel / kTileSize;
      if (!(touched >> y & 1)) {
        for (size_t x = 0; x < kTileSize; x += hn::Lanes(d)) {
          hn::Store(hn::Zero(d), d, weights + y * kTileSize + x);
        }
        touched |= 1u << y;
      }
      hn::Store(weight, d, weights + pixel);
    };
    VisitSplat(splat, list, live, transmittance, hit);
    if (touched != 0) AppendEntry(row, weights, touched, tile);
  };
  ForEachSplat(list, transmittance, visit, [](int64_t) {});
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

const TileKernels* Kernels() {
  static constexpr TileKernels kKernels = {BlendTile,    BlendTileBetween, TransposeTile,
                                           DepthTile,    WeightsOfTile,    CompactTile,
                                           BlendWeights, TransposeWeights};
  return &kKernels;
}

const char* TargetName() { return hwy::TargetName(HWY_TARGET); }

}  // namespace HWY_NAMESPACE
}  // namespace retint
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace retint {

HWY_EXPORT(Kernels);
HWY_EXPORT(TargetName);

const TileKernels& SimdTileKernels() { return *HWY_DYNAMIC_DISPATCH(Kernels)(); }
const char* SimdTargetName() { return HWY_DYNAMIC_DISPATCH(TargetName)(); }

}  // namespace retint
#endif
