// SPDX-License-Identifier: BSD-3-Clause
// The arithmetic of codecs on many Gaussians at a time. On one machine, the bits of a Gaussian do
// not depend on the others, so that a writer reproduces a reader's values of a record.
#pragma once

#include <array>
#include <cstddef>

#include "splat_io/splat_row.h"

namespace retint {

// LogScale() of each value, in place. A value that is negative or not a number becomes NaN;
// infinity does not change.
void LogScales(float* scales, size_t count);

// Bounds of a chunk in a compressed .ply: least x, y, z and greatest x, y, z of positions, then of
// log scales, then of colors.
using ChunkBounds = std::array<float, 18>;

// Unpacks `count` vertices of a compressed .ply, 16 bytes each (position, rotation, scale, color).
// They go to the rows from `to` on, colors to the first three of a row's `sh_values` coefficients.
// `vertices` needs an alignment of 4 bytes.
void UnpackVertices(const char* vertices, size_t count, const ChunkBounds& bounds,
                    const RowPlaces& to, size_t sh_values);

// Unpacks 45 bytes a Gaussian, [3, 15], to values 3 to 47 of its [16, 3].
void UnpackShOfDegree3(const char* bytes, size_t count, float* sh);

}  // namespace retint
