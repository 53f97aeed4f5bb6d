// SPDX-License-Identifier: BSD-3-Clause
// The codecs' arithmetic on many Gaussians at a time. One machine gives a Gaussian the same bits
// whichever others are unpacked with it, so that a writer finds a reader's values of a record.
#pragma once

#include <array>
#include <cstddef>

#include "splat_io/splat_row.h"

namespace retint {

// LogScale() of each value, in place. A value that is negative or not a number becomes NaN,
// infinity stays.
void LogScales(float* scales, size_t count);

// A chunk's bounds in a compressed .ply: the least x, y, z and the greatest, of positions, log
// scales and colors in turn.
using ChunkBounds = std::array<float, 18>;

// Unpacks `count` vertices of a compressed .ply, 16 bytes each (position, rotation, scale, color),
// to the rows from `to` on; of spherical harmonics the first three of each row, which has
// `sh_values`. `vertices` is aligned to 4 bytes.
void UnpackVertices(const char* vertices, size_t count, const ChunkBounds& bounds,
                    const RowPlaces& to, size_t sh_values);

// Unpacks 45 bytes a Gaussian, [3, 15], to values 3 to 47 of its 48, [16, 3].
void UnpackShOfDegree3(const char* bytes, size_t count, float* sh);

}  // namespace retint
