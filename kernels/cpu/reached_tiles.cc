// SPDX-License-Identifier: BSD-3-Clause
// ReachedColumns() and StripExtent() in Highway, compiled once a target and chosen at run time.
#include "kernels/cpu/reached_tiles.h"

#include <cstddef>

#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/cpu/reached_tiles.cc"
#include <hwy/foreach_target.h>
// After foreach_target.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace retint {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using RowsTag = hn::CappedTag<double, kRowSlack>;
using Rows = hn::Vec<RowsTag>;

void ReachedColumnsOfRows(const TileGrid& grid, const Reach& reach, double x, double y,
                          const TileRows& rows, int32_t* first, int32_t* last) {
  const RowsTag d;
  const hn::Rebind<int32_t, RowsTag> di;
  const auto set = [&](double value) HWY_ATTR { return hn::Set(d, value); };
  const Rows b_squared = set(reach.B * reach.B), four_a = set(4 * reach.A);
  const Rows inverse = set(1 / (2 * reach.A)), half_height = set(reach.half_height);
  for (int row = rows.first; row <= rows.last; row += int(hn::Lanes(d))) {
    const Rows row_top = hn::Mul(hn::Iota(d, double(row)), set(kTileSize));
    const Rows row_bottom = hn::Add(row_top, set(kTileSize - 1));
    const Rows dy0 = hn::Max(hn::Add(hn::Max(row_top, set(rows.top)), set(0.5 - y - kTileSlack)),
                             hn::Neg(half_height));
    const Rows dy1 = hn::Min(
        hn::Add(hn::Min(row_bottom, set(rows.bottom)), set(0.5 - y + kTileSlack)), half_height);
    // The end of the ellipse's part inside the strip, to the right or to the left of its middle.
    const auto end = [&](double tip, auto add) HWY_ATTR {
      const Rows dy = hn::Min(hn::Max(set(tip), dy0), dy1), squared = hn::Mul(dy, dy);
      const Rows root =
          hn::Sub(hn::Mul(b_squared, squared),
                  hn::Mul(four_a, hn::Sub(hn::Mul(set(reach.C), squared), set(reach.s))));
      const Rows width = hn::Sqrt(hn::Max(root, hn::Zero(d)));
      return hn::Add(hn::Mul(add(hn::Mul(set(-reach.B), dy), width), inverse), set(x - 0.5));
    };
    const Rows right = end(reach.tip, [](Rows a, Rows b) HWY_ATTR { return hn::Add(a, b); });
    const Rows left = end(-reach.tip, [](Rows a, Rows b) HWY_ATTR { return hn::Sub(a, b); });
    const Rows begin = hn::Max(hn::Ceil(hn::Sub(left, set(kTileSlack))), hn::Zero(d));
    const Rows stop = hn::Min(hn::Floor(hn::Add(right, set(kTileSlack))), set(grid.width - 1));
    const auto reached = hn::And(hn::Le(dy0, dy1), hn::Le(begin, stop));
    // -1 is left of every tile.
    const Rows until = hn::IfThenElse(reached, stop, set(-kTileSize));
    const Rows from = hn::IfThenElse(reached, begin, hn::Zero(d));
    static_assert(kTileSize == 16);
    hn::StoreU(hn::ShiftRight<4>(hn::DemoteTo(di, from)), di, first + (row - rows.first));
    hn::StoreU(hn::ShiftRight<4>(hn::DemoteTo(di, until)), di, last + (row - rows.first));
  }
}

ReachedColumnsFunction Function() { return ReachedColumnsOfRows; }

}  // namespace HWY_NAMESPACE
}  // namespace retint
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace retint {

HWY_EXPORT(Function);

ReachedColumnsFunction ReachedColumnsOfTarget() { return HWY_DYNAMIC_DISPATCH(Function)(); }

}  // namespace retint
#endif
