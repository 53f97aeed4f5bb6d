// SPDX-License-Identifier: BSD-3-Clause
// The tile loops in Highway, compiled once for each target and chosen at run time. A tile's row is
// one or more vectors. A chunk of a list's entries is stored with the rows that each reaches. Then
// a few rows at a time visit the entries that reach them, while their sums stay in registers.
#include <cstddef>

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

#include "kernels/cpu/weights-inl.h"

HWY_BEFORE_NAMESPACE();
namespace retint {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using RowTag = hn::CappedTag<float, kTileSize>;
using Row = hn::Vec<RowTag>;
using Pixels = hn::Mask<RowTag>;

// 2^e for e in [log2(1 / 255), 0], relative error below 3e-6; garbage, but no trap, outside. The
// fraction of e, in [-1/2, 1/2], goes through the best polynomial of degree four, and its integer
// is added to the result's exponent. Adding kRound leaves that integer in a float's low bits.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V Exp2(D d, V e) {
  constexpr float kRound = 12582912;  // 1.5 * 2^23
  const hn::RebindToSigned<D> di;
  const V rounded = hn::Add(e, hn::Set(d, kRound));
  const V fraction = hn::Sub(e, hn::Sub(rounded, hn::Set(d, kRound)));
  V p = hn::Set(d, 0.00957010211f);
  p = hn::MulAdd(p, fraction, hn::Set(d, 0.0559178591f));
  p = hn::MulAdd(p, fraction, hn::Set(d, 0.240247443f));
  p = hn::MulAdd(p, fraction, hn::Set(d, 0.693121791f));
  p = hn::MulAdd(p, fraction, hn::Set(d, 0.999999285f));
  return hn::BitCast(d, hn::Add(hn::BitCast(di, p), hn::ShiftLeft<23>(hn::BitCast(di, rounded))));
}

constexpr size_t kLanes = hn::MaxLanes(RowTag());
constexpr size_t kRowVectors = kTileSize / kLanes;
// Rows whose sums stay in registers together.
constexpr size_t kGroupRows = kRowVectors == 1 ? 2 : 1;
constexpr size_t kVectors = kGroupRows * kRowVectors;
constexpr int kChunk = 32;        // entries that are done together, a bit each
constexpr int64_t kPrefetch = 6;  // entries ahead

// Some entries of a list. An exponent at row y and column x is bx[x] * dy[y] + (ax2[x] + cdy2[y]).
struct Chunk {
  HWY_ALIGN float bx[kChunk][kTileSize];
  HWY_ALIGN float ax2[kChunk][kTileSize];
  HWY_ALIGN float dy[kChunk][kTileSize];
  HWY_ALIGN float cdy2[kChunk][kTileSize];
  HWY_ALIGN uint32_t reach[kTileSize];  // bit i: entry i may reach the row
};

// An exponent grows along a row up to dx = -b / (2 a) dy and falls beyond. A row is reached if the
// exponent is large enough at the tile's column nearest to that dx.
HWY_INLINE void LoadChunk(const TileList& list, int64_t first, int count, Chunk* chunk) {
  const RowTag d;
  const hn::RebindToUnsigned<RowTag> du;
  hn::Vec<decltype(du)> reach[kRowVectors];
  for (auto& rows : reach) rows = hn::Zero(du);
  // Slightly below a pixel's threshold, to allow for rounding. An extra row costs little, since its
  // pixels are tested.
  constexpr float kSlack = 1e-2f, kRounding = 1e-6f;
  for (int i = 0; i < count; ++i) {
    // Lists jump about in memory.
    const int64_t ahead = first + i + kPrefetch < list.count ? first + i + kPrefetch : first + i;
    hwy::Prefetch(&list.splats[list.entries[ahead]]);
    const Splat& splat = list.splats[list.entries[first + i]];
    const Row a = hn::Set(d, splat.a), b = hn::Set(d, splat.b), c = hn::Set(d, splat.c);
    const Row log2_opacity = hn::Set(d, splat.log2_opacity);
    const float left = float(list.x0) + 0.5f - splat.x;
    const float right = left + float(kTileSize - 1);
    const Row leftmost = hn::Set(d, left), rightmost = hn::Set(d, right);
    const Row least =
        hn::Set(d, kLog2MinAlpha - kSlack + kRounding * splat.a * (left * left + right * right));
    const Row slope = hn::Set(d, -0.5f * splat.b / splat.a);
    for (size_t v = 0; v < kRowVectors; ++v) {
      const int at = int(v * kLanes);
      const Row dx = hn::Iota(d, float(list.x0 + at) + 0.5f - splat.x);
      hn::Store(hn::Mul(b, dx), d, chunk->bx[i] + at);
      hn::Store(hn::MulAdd(hn::Mul(a, dx), dx, log2_opacity), d, chunk->ax2[i] + at);
      const Row dy = hn::Iota(d, float(list.y0 + at) + 0.5f - splat.y);
      const Row cdy2 = hn::Mul(hn::Mul(c, dy), dy);
      hn::Store(dy, d, chunk->dy[i] + at);
      hn::Store(cdy2, d, chunk->cdy2[i] + at);
      const Row top = hn::Min(hn::Max(hn::Mul(slope, dy), leftmost), rightmost);
      const Row exponent = hn::MulAdd(hn::MulAdd(a, top, hn::Mul(b, dy)), top,
                                      hn::MulAdd(hn::Set(d, 1 - kRounding), cdy2, log2_opacity));
      const auto reaches = hn::RebindMask(du, hn::Ge(exponent, least));
      reach[v] = hn::Or(reach[v], hn::IfThenElseZero(reaches, hn::Set(du, uint32_t{1} << i)));
    }
  }
  for (size_t v = 0; v < kRowVectors; ++v) hn::Store(reach[v], du, chunk->reach + v * kLanes);
}

// Rows of a tile that are blended together. If there are too few, a row is repeated whose pixels
// are all done.
struct RowGroup {
  size_t rows[kGroupRows];
  size_t Pixel(size_t v) const {
    return rows[v / kRowVectors] * kTileSize + v % kRowVectors * kLanes;
  }
  uint32_t Reach(const Chunk& chunk) const {
    uint32_t entries = 0;
    for (const size_t y : rows) entries |= chunk.reach[y];
    return entries;
  }
};

// The rows that have a live pixel, in groups; returns how many there are.
HWY_INLINE size_t LiveGroups(const float* transmittance, RowGroup* groups) {
  const RowTag d;
  size_t live[kTileSize + 1], count = 0, done = 0;
  for (size_t y = 0; y < kTileSize; ++y) {
    bool any = false;
    for (size_t x = 0; x < kTileSize; x += kLanes) {
      const Row t = hn::Load(d, transmittance + y * kTileSize + x);
      any = any || !hn::AllTrue(d, hn::Lt(t, hn::Zero(d)));
    }
    live[count] = y;
    count += any;
    if (!any) done = y;
  }
  size_t num_groups = 0;
  for (size_t i = 0; i < count; i += kGroupRows, ++num_groups) {
    for (size_t r = 0; r < kGroupRows; ++r) {
      groups[num_groups].rows[r] = i + r < count ? live[i + r] : done;
    }
  }
  return num_groups;
}

// BlendStep for the vectors of a group with the entries of a chunk. Calls hit(entry, vector,
// weights, T before, T after, &which pixels are live) for vectors with a pixel of alpha >=
// kMinAlpha.
template <class Hit>
HWY_INLINE void VisitGroup(const Chunk& chunk, const RowGroup& group,
                           float* HWY_RESTRICT transmittance, const Hit& hit) {
  const RowTag d;
  Row t[kVectors];
  Pixels live[kVectors];
  for (size_t v = 0; v < kVectors; ++v) {
    t[v] = hn::Load(d, transmittance + group.Pixel(v));
    live[v] = hn::Gt(t[v], hn::Zero(d));
    t[v] = hn::Abs(t[v]);
  }
  for (uint32_t left = group.Reach(chunk); left != 0; left &= left - 1) {
    const size_t i = hwy::Num0BitsBelowLS1Bit_Nonzero32(left);
    Row exponent[kVectors];
    Pixels near[kVectors];
    for (size_t v = 0; v < kVectors; ++v) {
      const size_t x = v % kRowVectors * kLanes, y = group.rows[v / kRowVectors];
      exponent[v] =
          hn::MulAdd(hn::Load(d, chunk.bx[i] + x), hn::Set(d, chunk.dy[i][y]),
                     hn::Add(hn::Load(d, chunk.ax2[i] + x), hn::Set(d, chunk.cdy2[i][y])));
      near[v] = hn::And(hn::Ge(exponent[v], hn::Set(d, kLog2MinAlpha)), live[v]);
    }
    Pixels any = near[0];
    for (size_t v = 1; v < kVectors; ++v) any = hn::Or(any, near[v]);
    if (hn::AllFalse(d, any)) continue;
    for (size_t v = 0; v < kVectors; ++v) {
      const Row alpha = hn::Min(hn::Set(d, kMaxAlpha), Exp2(d, exponent[v]));
      const Row after = hn::NegMulAdd(alpha, t[v], t[v]);
      const Pixels ends = hn::And(near[v], hn::Lt(after, hn::Set(d, kMinTransmittance)));
      const Pixels blended = hn::AndNot(ends, near[v]);
      const Row weight = hn::IfThenElseZero(blended, hn::Mul(alpha, t[v])), before = t[v];
      live[v] = hn::AndNot(ends, live[v]);
      t[v] = hn::IfThenElse(blended, after, t[v]);
      hit(i, v, weight, before, t[v], live[v]);
    }
  }
  for (size_t v = 0; v < kVectors; ++v) {
    hn::Store(hn::IfThenElse(live[v], t[v], hn::Neg(t[v])), d, transmittance + group.Pixel(v));
  }
}

// visit(first entry, count, chunk, groups, number of groups) over the list until every pixel is
// done; returns where it ended.
template <class Visit>
HWY_INLINE int64_t ForEachChunk(const TileList& list, const float* transmittance,
                                const Visit& visit) {
  Chunk chunk;
  RowGroup groups[kTileSize];
  for (int64_t first = 0; first < list.count; first += kChunk) {
    const size_t num_groups = LiveGroups(transmittance, groups);
    if (num_groups == 0) return first;
    const int count = int(list.count - first < kChunk ? list.count - first : kChunk);
    LoadChunk(list, first, count, &chunk);
    visit(first, count, chunk, groups, num_groups);
  }
  return list.count;
}

HWY_INLINE int32_t RowIndex(const TileList& list, int64_t entry) {
  const int32_t splat = list.entries[entry];
  return list.splat_rows ? list.splat_rows[splat] : splat;
}

// The features of a chunk's entries, fetched ahead.
template <int C>
HWY_INLINE void FindFeatures(const TileList& list, int64_t first, int count, const float* features,
                             const float** from) {
  static constexpr float kNothing[C] = {};
  for (int i = 0; i < count; ++i) {
    const int32_t row = RowIndex(list, first + i);
    from[i] = row < 0 ? kNothing : features + int64_t(row) * C;
    hwy::Prefetch(from[i]);
  }
}

// Adds weights times features of a chunk's entries to the sums of a group.
template <int C>
HWY_INLINE void BlendGroup(const Chunk& chunk, const RowGroup& group, const float* const* from,
                           float* HWY_RESTRICT sums, float* HWY_RESTRICT transmittance) {
  const RowTag d;
  Row sum[C][kVectors];
  for (int c = 0; c < C; ++c) {
    for (size_t v = 0; v < kVectors; ++v) {
      sum[c][v] = hn::Load(d, sums + c * kTilePixels + group.Pixel(v));
    }
  }
  VisitGroup(chunk, group, transmittance,
             [&](size_t i, size_t v, Row weight, Row, Row, Pixels&) HWY_ATTR {
               for (int c = 0; c < C; ++c) {
                 sum[c][v] = hn::MulAdd(weight, hn::Set(d, from[i][c]), sum[c][v]);
               }
             });
  for (int c = 0; c < C; ++c) {
    for (size_t v = 0; v < kVectors; ++v) {
      hn::Store(sum[c][v], d, sums + c * kTilePixels + group.Pixel(v));
    }
  }
}

template <int C>
void BlendTileC(const TileList& list, const float* HWY_RESTRICT features, float* HWY_RESTRICT sums,
                float* HWY_RESTRICT transmittance) {
  const float* from[kChunk];
  ForEachChunk(list, transmittance,
               [&](int64_t first, int count, const Chunk& chunk, const RowGroup* groups,
                   size_t num_groups) HWY_ATTR {
                 FindFeatures<C>(list, first, count, features, from);
                 for (size_t g = 0; g < num_groups; ++g) {
                   BlendGroup<C>(chunk, groups[g], from, sums, transmittance);
                 }
               });
}

// A pixel is done as soon as nothing that may still come takes it from one side of a limit to the
// other.
void BlendTileBetween(const TileList& list, const float* HWY_RESTRICT features, float low,
                      float high, float* HWY_RESTRICT sums, float* HWY_RESTRICT transmittance) {
  const RowTag d;
  const Row lowest = hn::Set(d, low), highest = hn::Set(d, high);
  const float* from[kChunk];
  ForEachChunk(
      list, transmittance,
      [&](int64_t first, int count, const Chunk& chunk, const RowGroup* groups,
          size_t num_groups) HWY_ATTR {
        FindFeatures<1>(list, first, count, features, from);
        for (size_t g = 0; g < num_groups; ++g) {
          const RowGroup& group = groups[g];
          Row sum[kVectors];
          for (size_t v = 0; v < kVectors; ++v) sum[v] = hn::Load(d, sums + group.Pixel(v));
          VisitGroup(chunk, group, transmittance,
                     [&](size_t i, size_t v, Row weight, Row, Row after, Pixels& live) HWY_ATTR {
                       sum[v] = hn::MulAdd(weight, hn::Set(d, *from[i]), sum[v]);
                       const auto settled =
                           hn::Or(hn::Ge(sum[v], highest), hn::Le(hn::Add(sum[v], after), lowest));
                       live = hn::AndNot(settled, live);
                     });
          for (size_t v = 0; v < kVectors; ++v) hn::Store(sum[v], d, sums + group.Pixel(v));
        }
      });
}

// The sums over the lanes of N vectors that lie one after the other, as the lanes of one.
#if HWY_TARGET == HWY_SCALAR
HWY_INLINE Row SumsOfLanes(const float* vectors) { return hn::Load(RowTag(), vectors); }
#else
template <size_t N = kLanes>
HWY_INLINE Row SumsOfLanes(const float* vectors) {
  const RowTag d;
  if constexpr (N == 1) {
    return hn::Load(d, vectors);
  } else {
    const Row low = SumsOfLanes<N / 2>(vectors);
    const Row high = SumsOfLanes<N / 2>(vectors + N / 2 * kLanes);
    return hn::Add(hn::ConcatEven(d, high, low), hn::ConcatOdd(d, high, low));
  }
}
#endif

template <int C>
void TransposeTileC(const TileList& list, const float* HWY_RESTRICT residual,
                    float* HWY_RESTRICT partials, float* HWY_RESTRICT transmittance) {
  const RowTag d;
  HWY_ALIGN float sums[C][kChunk][kLanes];
  HWY_ALIGN float totals[C][kChunk];
  const auto visit = [&](int64_t first, int count, const Chunk& chunk, const RowGroup* groups,
                         size_t num_groups) HWY_ATTR {
    for (int c = 0; c < C; ++c) {
      for (int i = 0; i < kChunk; ++i) hn::Store(hn::Zero(d), d, sums[c][i]);
    }
    for (int i = 0; i < count; ++i) {
      const uint32_t slot = list.slots[first + i];
      if (slot != kNoSlot) hwy::Prefetch(partials + int64_t(slot) * C);
    }
    for (size_t g = 0; g < num_groups; ++g) {
      Row wanted[C][kVectors];
      for (int c = 0; c < C; ++c) {
        for (size_t v = 0; v < kVectors; ++v) {
          wanted[c][v] = hn::Load(d, residual + c * kTilePixels + groups[g].Pixel(v));
        }
      }
      Row sum[C];
      VisitGroup(chunk, groups[g], transmittance,
                 [&](size_t i, size_t v, Row weight, Row, Row, Pixels&) HWY_ATTR {
                   for (int c = 0; c < C; ++c) {
                     if (v == 0) sum[c] = hn::Load(d, sums[c][i]);
                     sum[c] = hn::MulAdd(weight, wanted[c][v], sum[c]);
                     if (v == kVectors - 1) hn::Store(sum[c], d, sums[c][i]);
                   }
                 });
    }
    for (int c = 0; c < C; ++c) {
      for (size_t i = 0; i < kChunk; i += kLanes) {
        hn::Store(SumsOfLanes(sums[c][i]), d, totals[c] + i);
      }
    }
    for (int i = 0; i < count; ++i) {
      if (list.slots[first + i] == kNoSlot) continue;
      float* const out = partials + int64_t(list.slots[first + i]) * C;
      for (int c = 0; c < C; ++c) out[c] = totals[c][i];
    }
  };
  for (int64_t i = ForEachChunk(list, transmittance, visit); i < list.count; ++i) {
    if (list.slots[i] == kNoSlot) continue;
    float* const out = partials + int64_t(list.slots[i]) * C;
    for (int c = 0; c < C; ++c) out[c] = 0;
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
  const float* from[kChunk];
  const auto visit = [&](int64_t first, int count, const Chunk& chunk, const RowGroup* groups,
                         size_t num_groups) HWY_ATTR {
    for (int i = 0; i < count; ++i) from[i] = &list.splats[list.entries[first + i]].depth;
    for (size_t g = 0; g < num_groups; ++g) {
      if constexpr (!kMedian) {
        BlendGroup<1>(chunk, groups[g], from, sums, transmittance);
        continue;
      }
      VisitGroup(chunk, groups[g], transmittance,
                 [&](size_t i, size_t v, Row weight, Row before, Row after, Pixels&) HWY_ATTR {
                   const size_t pixel = groups[g].Pixel(v);
                   const Row depth = hn::Set(d, *from[i]);
                   hn::Store(hn::MulAdd(weight, depth, hn::Load(d, sums + pixel)), d, sums + pixel);
                   const auto crosses =
                       hn::And(hn::And(hn::Ge(before, limit), hn::Lt(after, limit)),
                               hn::Gt(weight, hn::Zero(d)));
                   const Row old = hn::Load(d, median + pixel);
                   hn::Store(hn::IfThenElse(crosses, depth, old), d, median + pixel);
                 });
    }
  };
  ForEachChunk(list, transmittance, visit);
}

void DepthTile(const TileList& list, float threshold, float* sums, float* median,
               float* transmittance) {
  const auto find = median ? DepthTileOf<true> : DepthTileOf<false>;
  find(list, threshold, sums, median, transmittance);
}

template <bool kBlends>
void WeightsOf(const TileList& list, const float* HWY_RESTRICT colors, WeightTile* tile,
               float* HWY_RESTRICT sums, float* HWY_RESTRICT transmittance) {
  const RowTag d;
  HWY_ALIGN float weights[kChunk][kTilePixels];
  const float* from[kChunk];
  const auto visit = [&](int64_t first, int count, const Chunk& chunk, const RowGroup* groups,
                         size_t num_groups) HWY_ATTR {
    uint32_t touched[kChunk] = {};  // rows
    for (int i = 0; kBlends && i < count; ++i) {
      from[i] = colors + int64_t(list.entries[first + i]) * 3;
      hwy::Prefetch(from[i]);
    }
    for (size_t g = 0; g < num_groups; ++g) {
      const RowGroup& group = groups[g];
      uint32_t rows = 0;
      for (const size_t y : group.rows) rows |= 1u << y;
      Row sum[3][kVectors];
      for (size_t v = 0; kBlends && v < 3 * kVectors; ++v) {
        sum[v / kVectors][v % kVectors] =
            hn::Load(d, sums + v / kVectors * kTilePixels + group.Pixel(v % kVectors));
      }
      VisitGroup(chunk, group, transmittance,
                 [&](size_t i, size_t v, Row weight, Row, Row, Pixels&) HWY_ATTR {
                   hn::Store(weight, d, weights[i] + group.Pixel(v));
                   touched[i] |= rows;
                   for (int c = 0; kBlends && c < 3; ++c) {
                     sum[c][v] = hn::MulAdd(weight, hn::Set(d, from[i][c]), sum[c][v]);
                   }
                 });
      for (size_t v = 0; kBlends && v < 3 * kVectors; ++v) {
        hn::Store(sum[v / kVectors][v % kVectors], d,
                  sums + v / kVectors * kTilePixels + group.Pixel(v % kVectors));
      }
    }
    for (int i = 0; i < count; ++i) {
      const int32_t row = RowIndex(list, first + i);
      if (row >= 0 && touched[i] != 0) AppendEntry(row, weights[i], touched[i], tile);
    }
  };
  ForEachChunk(list, transmittance, visit);
}

void WeightsOfTile(const TileList& list, const float* colors, WeightTile* tile, float* sums,
                   float* transmittance) {
  const auto find = colors ? WeightsOf<true> : WeightsOf<false>;
  find(list, colors, tile, sums, transmittance);
}

const TileKernels* Kernels() {
  static constexpr TileKernels kKernels = {
      BlendTile,         BlendTileBetween, TransposeTile, DepthTile,        WeightsOfTile,
      FindLargeHalfRows, CompactTile,      BlendWeights,  TransposeWeights, Residual};
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
