// SPDX-License-Identifier: BSD-3-Clause
// The tile loops in Highway, compiled once a target and chosen at run time. A tile's row is one or
// more vectors; a splat visits only the rows that its ellipse reaches, and the exponent is compared
// before it is raised, so that most vectors cost a few instructions.
#include <cstddef>

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

// 2^e for e in [-126, 0], relative error below 2e-7; garbage, but no trap, outside. Chebyshev
// interpolation of 2^f on [-0.5, 0.5]; the integer part comes from the sum's low mantissa bits.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V Exp2(D d, V e) {
  const hn::RebindToSigned<D> di;
  const V magic = hn::Set(d, 12582912.0f);  // 1.5 * 2^23
  const V shifted = hn::Add(e, magic);
  const V f = hn::Sub(e, hn::Sub(shifted, magic));
  V p = hn::Set(d, 1.33908634e-3f);
  p = hn::MulAdd(p, f, hn::Set(d, 9.67603192e-3f));
  p = hn::MulAdd(p, f, hn::Set(d, 5.55035711e-2f));
  p = hn::MulAdd(p, f, hn::Set(d, 2.40221075e-1f));
  p = hn::MulAdd(p, f, hn::Set(d, 6.93147188e-1f));
  p = hn::MulAdd(p, f, hn::Set(d, 1.00000008f));
  const auto exponent = hn::ShiftLeft<23>(hn::BitCast(di, shifted));
  return hn::BitCast(d, hn::Add(hn::BitCast(di, p), exponent));
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

// The quadratic form of a splat along one row of vectors: its exponent at row offset dy is
// bx * dy + (c dy^2 + ax2).
struct SplatColumns {
  Row bx, ax2;
};

HWY_INLINE SplatColumns ColumnsOf(const Splat& splat, int x0, size_t x) {
  const RowTag d;
  const Row dx = hn::Iota(d, float(x0 + int(x)) + 0.5f - splat.x);
  SplatColumns columns;
  columns.bx = hn::Mul(hn::Set(d, splat.b), dx);
  columns.ax2 = hn::MulAdd(hn::Mul(hn::Set(d, splat.a), dx), dx, hn::Set(d, splat.log2_opacity));
  return columns;
}

// BlendStep for a vector of pixels: hit(y, weights, T before, T after) where any pixel has a
// weight.
template <class Hit>
HWY_INLINE void VisitSplat(const Splat& splat, const TileList& list, size_t x, uint32_t live,
                           RowRange rows, float* HWY_RESTRICT transmittance, const Hit& hit) {
  const RowTag d;
  const SplatColumns columns = ColumnsOf(splat, list.x0, x);
  const Row threshold = hn::Set(d, kLog2MinAlpha);
  const float dy0 = float(list.y0) + 0.5f - splat.y;
  for (int y = rows.first; y <= rows.last; ++y) {
    if (!(live >> y & 1)) continue;
    const float dy = dy0 + float(y);
    const Row exponent =
        hn::MulAdd(columns.bx, hn::Set(d, dy), hn::Add(columns.ax2, hn::Set(d, splat.c * dy * dy)));
    const auto near = hn::Ge(exponent, threshold);
    if (hn::AllFalse(d, near)) continue;
    float* HWY_RESTRICT at = transmittance + y * kTileSize + int(x);
    const Row before = hn::Load(d, at);
    const Row alpha = hn::IfThenElseZero(near, hn::Min(hn::Set(d, kMaxAlpha), Exp2(d, exponent)));
    const Row after = hn::NegMulAdd(alpha, before, before);
    const auto done = hn::Lt(after, hn::Set(d, kMinTransmittance));
    const Row weight = hn::IfThenZeroElse(done, hn::Mul(alpha, before));
    hn::Store(hn::IfThenElse(done, hn::Neg(hn::Abs(before)), after), d, at);
    hit(y, weight, before, after);
  }
}

// splat_visit(entry, splat, live rows, row range) over the list until every pixel is done.
template <class Visit>
HWY_INLINE int64_t ForEachSplat(const TileList& list, const float* transmittance,
                                const Visit& visit) {
  uint32_t live = 0;
  for (int64_t i = 0; i < list.count; ++i) {
    if (i % 16 == 0) {
      live = LiveRows(transmittance);
      if (live == 0) return i;
    }
    const Splat& splat = list.splats[list.entries[i]];
    visit(i, splat, live, RowsOf(splat, list.y0));
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
  ForEachSplat(list, transmittance,
               [&](int64_t i, const Splat& splat, uint32_t live, RowRange rows) HWY_ATTR {
                 const int32_t row = RowIndex(list, i);
                 static constexpr float kNothing[C] = {};
                 const float* from = row < 0 ? kNothing : features + int64_t(row) * C;
                 Row feature[C];
                 for (int c = 0; c < C; ++c) feature[c] = hn::Set(d, from[c]);
                 for (size_t x = 0; x < kTileSize; x += hn::Lanes(d)) {
                   VisitSplat(splat, list, x, live, rows, transmittance,
                              [&](int y, Row weight, Row, Row) HWY_ATTR {
                                float* at = sums + y * kTileSize + int(x);
                                for (int c = 0; c < C; ++c, at += kTilePixels) {
                                  hn::Store(hn::MulAdd(weight, feature[c], hn::Load(d, at)), d, at);
                                }
                              });
                 }
               });
}

template <int C>
void TransposeTileC(const TileList& list, const float* HWY_RESTRICT residual,
                    float* HWY_RESTRICT partials, float* HWY_RESTRICT transmittance) {
  const RowTag d;
  const int64_t visited =
      ForEachSplat(list, transmittance,
                   [&](int64_t i, const Splat& splat, uint32_t live, RowRange rows) HWY_ATTR {
                     Row sum[C];
                     for (int c = 0; c < C; ++c) sum[c] = hn::Zero(d);
                     bool any = false;
                     for (size_t x = 0; x < kTileSize; x += hn::Lanes(d)) {
                       VisitSplat(splat, list, x, live, rows, transmittance,
                                  [&](int y, Row weight, Row, Row) HWY_ATTR {
                                    const float* at = residual + y * kTileSize + int(x);
                                    for (int c = 0; c < C; ++c, at += kTilePixels) {
                                      sum[c] = hn::MulAdd(weight, hn::Load(d, at), sum[c]);
                                    }
                                    any = true;
                                  });
                     }
                     if (list.slots[i] == kNoSlot) return;
                     float* out = partials + int64_t(list.slots[i]) * C;
                     for (int c = 0; c < C; ++c)
                       out[c] = any ? hn::GetLane(hn::SumOfLanes(d, sum[c])) : 0.0f;
                   });
  for (int64_t i = visited; i < list.count; ++i) {
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

void DepthTile(const TileList& list, float threshold, float* HWY_RESTRICT sums,
               float* HWY_RESTRICT median, float* HWY_RESTRICT transmittance) {
  const RowTag d;
  const Row limit = hn::Set(d, threshold);
  ForEachSplat(
      list, transmittance, [&](int64_t, const Splat& splat, uint32_t live, RowRange rows) HWY_ATTR {
        const Row depth = hn::Set(d, splat.depth);
        for (size_t x = 0; x < kTileSize; x += hn::Lanes(d)) {
          VisitSplat(
              splat, list, x, live, rows, transmittance,
              [&](int y, Row weight, Row before, Row after) HWY_ATTR {
                const int at = y * kTileSize + int(x);
                hn::Store(hn::MulAdd(weight, depth, hn::Load(d, sums + at)), d, sums + at);
                const auto crosses = hn::And(hn::And(hn::Ge(before, limit), hn::Lt(after, limit)),
                                             hn::Gt(weight, hn::Zero(d)));
                hn::Store(hn::IfThenElse(crosses, depth, hn::Load(d, median + at)), d, median + at);
              });
        }
      });
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
  alignas(64) float weights[kTilePixels];
  ForEachSplat(list, transmittance,
               [&](int64_t i, const Splat& splat, uint32_t live, RowRange rows) HWY_ATTR {
                 const int32_t row = RowIndex(list, i);
                 uint32_t touched = 0;
                 for (size_t x = 0; x < kTileSize; x += hn::Lanes(d)) {
                   VisitSplat(splat, list, x, live, rows, transmittance,
                              [&](int y, Row weight, Row, Row) HWY_ATTR {
                                if (row < 0) return;
                                if (!(touched >> y & 1)) {
                                  for (size_t z = 0; z < kTileSize; z += hn::Lanes(d)) {
                                    hn::Store(hn::Zero(d), d, weights + y * kTileSize + int(z));
                                  }
                                  touched |= 1u << y;
                                }
                                hn::Store(weight, d, weights + y * kTileSize + int(x));
                              });
                 }
                 if (touched != 0) AppendEntry(row, weights, touched, tile);
               });
}

// visit(offset of the half row's vector in the tile, weights in steps) for an entry's weights.
template <class Visit>
HWY_INLINE const uint16_t* VisitWeights(const WeightEntry& entry, const uint16_t* weights,
                                        const Visit& visit) {
  const HalfTag d;
  const hn::Rebind<uint16_t, HalfTag> d16;
  const hn::RebindToSigned<HalfTag> di;
  for (uint32_t left = entry.half_rows; left != 0; left &= left - 1, weights += 8) {
    const size_t half = hwy::Num0BitsBelowLS1Bit_Nonzero32(left);
    for (size_t x = 0; x < 8; x += hn::Lanes(d)) {
      const auto steps = hn::PromoteTo(di, hn::LoadU(d16, weights + x));
      visit(8 * half + x, hn::ConvertTo(d, steps));
    }
  }
  return weights;
}

template <int C>
void BlendWeightsC(const WeightTile& tile, const float* HWY_RESTRICT features,
                   float* HWY_RESTRICT sums) {
  const HalfTag d;
  const uint16_t* weights = tile.weights.data();
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

template <int C>
void TransposeWeightsC(const WeightTile& tile, const float* HWY_RESTRICT residual,
                       float* HWY_RESTRICT partials) {
  const HalfTag d;
  const uint16_t* weights = tile.weights.data();
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
  WithChannels(channels,
               [&](auto c) HWY_ATTR { BlendWeightsC<decltype(c)::value>(tile, features, sums); });
}

void TransposeWeights(const WeightTile& tile, const float* residual, int channels,
                      float* partials) {
  WithChannels(channels, [&](auto c) HWY_ATTR {
    TransposeWeightsC<decltype(c)::value>(tile, residual, partials);
  });
}

const TileKernels* Kernels() {
  static constexpr TileKernels kKernels = {BlendTile,     TransposeTile, DepthTile,
                                           WeightsOfTile, BlendWeights,  TransposeWeights};
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
