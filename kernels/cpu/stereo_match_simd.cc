// SPDX-License-Identifier: BSD-3-Clause
// The matcher's steps in Highway, compiled once a target and chosen at run time.
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "kernels/cpu/stereo_match.h"

#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/cpu/stereo_match_simd.cc"
#include <hwy/foreach_target.h>
// After foreach_target.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace retint {
namespace HWY_NAMESPACE {
#if HWY_TARGET == HWY_SCALAR

const StereoKernels* StereoKernelsOfTarget() { return &ScalarStereoKernels(); }

#else
namespace hn = hwy::HWY_NAMESPACE;

// Counts of disparities are multiples of 32.
using Tag8 = hn::CappedTag<uint8_t, kStereoCountStep>;
using Tag16 = hn::RepartitionToWide<Tag8>;
using V8 = hn::Vec<Tag8>;
using V16 = hn::Vec<Tag16>;
constexpr int kLanes8 = int(hn::MaxLanes(Tag8())), kLanes16 = kLanes8 / 2;

HWY_INLINE int LeastOf(V16 v) {
  const Tag16 d;
  if constexpr (kLanes16 > 8) {
    const hn::Half<Tag16> half;
    return int(
        hn::GetLane(hn::MinOfLanes(half, hn::Min(hn::LowerHalf(v), hn::UpperHalf(half, v)))));
  } else {
    return int(hn::GetLane(hn::MinOfLanes(d, v)));
  }
}
HWY_INLINE int LeastOf(V8 v) {
  const Tag16 d;
  const V16 pairs = hn::BitCast(d, v);
  return LeastOf(hn::Min(hn::And(pairs, hn::Set(d, uint16_t{0xff})), hn::ShiftRight<8>(pairs)));
}

void CensusRow(const float* const* rows, int width, uint8_t* planes, ptrdiff_t stride) {
  const hn::CappedTag<float, 16> d;
  const hn::RebindToUnsigned<decltype(d)> d32;
  const hn::Rebind<uint8_t, decltype(d)> d8;
  for (int u = 0; u < width; u += int(hn::Lanes(d))) {
    const auto middle = hn::LoadU(d, rows[kCensusV] + u + kCensusU);
    auto flat = hn::Eq(hn::Zero(d), hn::Zero(d));
    auto byte = hn::Zero(d32);
    int bit = 0;
    const auto store = [&] {
      hn::StoreU(hn::DemoteTo(d8, hn::BitCast(hn::RebindToSigned<decltype(d)>(), byte)), d8,
                 planes + bit / 8 * stride + u);
      byte = hn::Zero(d32);
    };
    for (int j = 0; j <= 2 * kCensusV; ++j) {
      for (int i = 0; i <= 2 * kCensusU; ++i) {
        if (j == kCensusV && i == kCensusU) continue;
        const auto other = hn::LoadU(d, rows[j] + u + i);
        const auto value = hn::BitCast(d, hn::Set(d32, uint32_t{1} << bit % 8));
        byte = hn::Or(byte, hn::BitCast(d32, hn::IfThenElseZero(hn::Lt(other, middle), value)));
        flat = hn::And(flat, hn::Eq(other, middle));
        if (bit % 8 == 7) store();
        ++bit;
      }
    }
    const auto value = hn::BitCast(d, hn::Set(d32, uint32_t{kCensusFlat}));
    byte = hn::Or(byte, hn::BitCast(d32, hn::IfThenElseZero(flat, value)));
    store();
  }
}

void CostRow(const StereoCostRow& row, uint8_t* costs) {
  const Tag8 d8;
  for (int u = row.begin; u < row.end; ++u, costs += row.count) {
    const uint8_t* own = row.own + u;
    if (own[(kCensusBytes - 1) * row.own_stride] & kCensusFlat) {
      std::memset(costs, 0, size_t(row.count));
      continue;
    }
    V8 here[kCensusBytes];
    for (int j = 0; j < kCensusBytes; ++j) here[j] = hn::Set(d8, own[j * row.own_stride]);
    const uint8_t* from = row.shifted + (row.width - 1 - u + row.lowest);
    for (int d = 0; d < row.count; d += kLanes8, from += kLanes8) {
      V8 cost = hn::Zero(d8);
      for (int j = 0; j < kCensusBytes; ++j) {
        const V8 there = hn::LoadU(d8, from + j * row.shifted_stride);
        cost = hn::Add(cost, hn::PopulationCount(hn::Xor(there, here[j])));
      }
      hn::StoreU(cost, d8, costs + d);
    }
    // Pixels before the shifted view's first one.
    const int inside = u - row.lowest + 1;
    if (inside >= row.count) continue;
    const int kept = inside > 0 ? inside : 0;
    std::memset(costs + kept, kMaxCensusCost, size_t(row.count - kept));
  }
}

void Step(const StereoStep& step) {
  const Tag8 d8;
  const Tag16 d16;
  const hn::Half<Tag8> half;
  const V8 p1 = hn::Set(d8, step.p1);
  for (int p = 0; p < step.paths; ++p) {
    const uint8_t* costs = step.costs + p * step.stride;
    uint16_t* sums = step.sums ? step.sums + p * step.stride : nullptr;
    uint8_t* state = step.states + p * StereoStateStride(step.count) + kStereoSlack;
    const V8 least = hn::Set(d8, step.least[p]);
    const V8 jump = hn::Set(d8, uint8_t(step.least[p] + step.p2));
    V8 lowest = hn::Set(d8, uint8_t{255}), before = hn::LoadU(d8, state - 1);
    for (int d = 0; d < step.count; d += kLanes8) {
      const V8 own = hn::LoadU(d8, state + d), after = hn::LoadU(d8, state + d + 1);
      // Before its first element is overwritten.
      const V8 next_before = hn::LoadU(d8, state + d + kLanes8 - 1);
      // Where the sum saturates the jump is less.
      const V8 near = hn::SaturatedAdd(hn::Min(before, after), p1);
      const V8 kept = hn::Sub(hn::Min(hn::Min(own, near), jump), least);
      const V8 cost = hn::Add(hn::LoadU(d8, costs + d), kept);
      hn::StoreU(cost, d8, state + d);
      lowest = hn::Min(lowest, cost);
      before = next_before;
      if (!sums) continue;
      V16 low = hn::PromoteTo(d16, hn::LowerHalf(half, cost));
      V16 high = hn::PromoteTo(d16, hn::UpperHalf(half, cost));
      if (!step.first) {
        low = hn::Add(low, hn::LoadU(d16, sums + d));
        high = hn::Add(high, hn::LoadU(d16, sums + d + kLanes16));
      }
      hn::StoreU(low, d16, sums + d);
      hn::StoreU(high, d16, sums + d + kLanes16);
    }
    step.least[p] = uint8_t(LeastOf(lowest));
  }
}

void SelectRow(const StereoSelectRow& row) {
  const Tag16 d16;
  const V16 most = hn::Set(d16, uint16_t{0xffff}), two = hn::Set(d16, uint16_t{2});
  const V16 iota = hn::Iota(d16, uint16_t{0});
  for (int u = 0; u < row.width; ++u) {
    const uint16_t* sums = row.sums + ptrdiff_t(u) * row.count;
    uint16_t* other_sum = row.other_sum + (row.width - 1 - u + row.lowest);
    uint16_t* other_index = row.other_index + (row.width - 1 - u + row.lowest);
    V16 lowest = most;
    for (int d = 0; d < row.count; d += kLanes16) {
      const V16 sum = hn::LoadU(d16, sums + d), other = hn::LoadU(d16, other_sum + d);
      lowest = hn::Min(lowest, sum);
      const auto less = hn::Lt(sum, other);
      const V16 index = hn::Add(iota, hn::Set(d16, uint16_t(d)));
      hn::StoreU(hn::Min(sum, other), d16, other_sum + d);
      hn::StoreU(hn::IfThenElse(less, index, hn::LoadU(d16, other_index + d)), d16,
                 other_index + d);
    }
    const int least = LeastOf(lowest);
    const V16 wanted = hn::Set(d16, uint16_t(least));
    int index = 0;
    for (int d = 0; d < row.count; d += kLanes16) {
      const auto found = hn::FindFirstTrue(d16, hn::Eq(hn::LoadU(d16, sums + d), wanted));
      if (found < 0) continue;
      index = d + int(found);
      break;
    }
    // All but index - 1 ... index + 1. A difference that wraps around is large.
    V16 second = most;
    for (int d = 0; d < row.count; d += kLanes16) {
      const V16 away = hn::Add(iota, hn::Set(d16, uint16_t(d - index + 1)));
      const V16 sum = hn::LoadU(d16, sums + d);
      second = hn::Min(second, hn::IfThenElse(hn::Eq(hn::Min(away, two), away), most, sum));
    }
    row.best[u] = {index, least, index > 0 ? sums[index - 1] : 0,
                   index + 1 < row.count ? sums[index + 1] : 0, LeastOf(second)};
  }
}

const StereoKernels* StereoKernelsOfTarget() {
  static constexpr StereoKernels kKernels = {CensusRow, CostRow, Step, SelectRow};
  return &kKernels;
}

#endif
}  // namespace HWY_NAMESPACE
}  // namespace retint
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace retint {

HWY_EXPORT(StereoKernelsOfTarget);

const StereoKernels& SimdStereoKernels() { return *HWY_DYNAMIC_DISPATCH(StereoKernelsOfTarget)(); }

}  // namespace retint
#endif
