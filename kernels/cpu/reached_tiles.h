// SPDX-License-Identifier: BSD-3-Clause
// The tiles that a splat reaches, several rows of tiles at a time.
#pragma once

#include <cstdint>

#include "kernels/common/tiles.h"

namespace retint {

// ReachedColumns() of the rows of tiles rows.first + i: columns [first[i], last[i]], none where
// first[i] > last[i]. Both have room for kRowSlack more than the rows.
using ReachedColumnsFunction = void (*)(const TileGrid& grid, const Reach& reach, double x,
                                        double y, const TileRows& rows, int32_t* first,
                                        int32_t* last);
inline constexpr int kRowSlack = 4;

ReachedColumnsFunction ReachedColumnsOfTarget();

}  // namespace retint
