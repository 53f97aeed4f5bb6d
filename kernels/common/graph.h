// SPDX-License-Identifier: BSD-3-Clause
// What is left of an edge between two pieces of surface (selection/completion.h).
#pragma once

#include <cmath>

#include "kernels/common/macros.h"

namespace retint {

// What is known of a node, each in [0, 1]: the probability that it is inside, by color, and what a
// valley at it leaves of an edge.
struct NodeLook {
  float prior, open;
};

// Neighbors of which one looks inside and the other outside touch, but are two things.
RETINT_HD float WeightBetween(const NodeLook& a, const NodeLook& b, float weight) {
  const float alike = 1 - std::fabs(a.prior - b.prior);
  return weight * alike * alike * (a.open < b.open ? a.open : b.open);
}

}  // namespace retint
