// SPDX-License-Identifier: BSD-3-Clause
// Points in an order in which neighbors in memory, or in a file, are neighbors in space.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace retint {

// Indices of the points [N, 3] along a Morton (Z-order) curve through their bounding box, 2^21
// cells along each axis; within a cell by index. The points are finite.
std::vector<uint32_t> MortonOrder(std::span<const float> points);

}  // namespace retint
