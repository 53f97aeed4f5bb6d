// SPDX-License-Identifier: BSD-3-Clause
// The cheapest division of a graph's nodes in two.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "selection/graph_solver.h"

namespace retint {

// The x in {0, 1} that minimizes  sum_edges w_ij |x_i - x_j| - sum_i odds_i x_i,  by maximum flow
// (Greig, Porteous and Seheult 1989; Boykov and Kolmogorov 2004). `odds`, of every node: log odds
// of 1; those of a node whose value is given are large.
std::vector<uint8_t> MinCut(const EdgeMatrix& edges, std::span<const float> odds);

}  // namespace retint
