// SPDX-License-Identifier: BSD-3-Clause
// Arrays that lie on the ranks' devices: their sums, and copies of one. Internal to render.
#pragma once

#include <cstddef>

#include "base/ranks.h"
#include "kernels/backend.h"

namespace retint {

// The part on its way at a time, in floats: as much memory is taken beside the array, or less.
inline constexpr size_t kFloatsOnTheWay = size_t{1} << 25;

// Collective; only if ranks.DevicesAreLinked(). values[i] = the sum of all ranks' values[i] in the
// order of the ranks, ((v_0 + v_1) + v_2) + ... So it is the same on all of them, in every run, and
// has the bytes of Ranks::SumByRank. Every rank adds up one piece of each stretch of the array, and
// sends the sum to the others. `scratch` is kept between calls.
void SumOnDevices(Ranks& ranks, Backend& backend, Buffer<float>& values, Buffer<float>& scratch,
                  size_t stretch = kFloatsOnTheWay);

// Collective, under the same condition. `values` of the rank `from` replaces that of the others.
void BroadcastOnDevices(Ranks& ranks, Backend& backend, Buffer<float>& values, int from);

}  // namespace retint
