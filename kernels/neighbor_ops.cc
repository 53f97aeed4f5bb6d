// SPDX-License-Identifier: BSD-3-Clause
#include "kernels/neighbor_ops.h"

#include "kernels/check.h"

namespace retint {

void NeighborOps::NeighborDistances(const NeighborDistancesParams& params) {
  Require(
      params.neighbors >= 1 && params.neighbors <= kMaxNeighbors && params.count > params.neighbors,
      "neighbors asked for: 1 to 32, and fewer than points");
  DoNeighborDistances(params);
}

}  // namespace retint
