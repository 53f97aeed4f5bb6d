// SPDX-License-Identifier: BSD-3-Clause
// The cheapest division of a graph's nodes into two sets.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "selection/graph_solver.h"

namespace retint {

// The x in {0, 1} that minimizes  sum_edges w_ij |x_i - x_j| - sum_i odds_i x_i,  by maximum flow
// (Greig, Porteous and Seheult 1989; Boykov and Kolmogorov 2004). `odds`: log odds of 1 for every
// node, large for nodes with a given value.
std::vector<uint8_t> MinCut(const EdgeMatrix& edges, std::span<const float> odds);

}  // namespace retint
