// SPDX-License-Identifier: BSD-3-Clause
// Searches among points, exhaustive: for a device. Elsewhere a search tree is the faster one
// (selection/neighbors.h), and the backend has no such group.
#pragma once

#include <cstdint>

#include "kernels/common/types.h"

namespace retint {

// distances[i] = mean distance from point i to the `neighbors` nearest others, [count]. Squares are
// added in x, y, z order and not fused, roots from the nearest on in double precision.
struct NeighborDistancesParams {
  const float* points;  // [count, 3]
  int64_t count;        // more than `neighbors`
  int32_t neighbors;    // 1 to kMaxNeighbors
  float* distances;     // [count]
};

class NeighborOps {
 public:
  virtual ~NeighborOps() = default;
  void NeighborDistances(const NeighborDistancesParams& params);

 protected:
  virtual void DoNeighborDistances(const NeighborDistancesParams& params) = 0;
};

}  // namespace retint
