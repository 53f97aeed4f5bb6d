// SPDX-License-Identifier: BSD-3-Clause
// The weight of an edge between two pieces of surface (selection/completion.h).
#pragma once

#include <cmath>

#include "kernels/common/macros.h"

namespace retint {

// Of a node, each in [0, 1]. `prior`: the probability, by color, that it is inside. `open`: the
// factor of its edges' weights, which is small in a crease of the surface.
struct NodeLook {
  float prior, open;
};

// Neighbors of which one looks inside and the other outside touch, but are two things.
RETINT_HD float WeightBetween(const NodeLook& a, const NodeLook& b, float weight) {
  const float alike = 1 - std::fabs(a.prior - b.prior);
  return weight * alike * alike * (a.open < b.open ? a.open : b.open);
}

}  // namespace retint
