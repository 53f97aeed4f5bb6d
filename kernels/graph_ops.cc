// SPDX-License-Identifier: BSD-3-Clause
#include "kernels/graph_ops.h"

#include <limits>

#include "kernels/check.h"

namespace retint {

int GraphOps::SolveGraph(const SolveGraphParams& params) {
  RequireCount(params.nodes);
  Require(params.nodes < std::numeric_limits<int32_t>::max(), "nodes of a graph: below 2^31 - 1");
  Require(params.tolerance > 0, "the tolerance of a solution must be above 0");
  Require(params.max_iterations >= 0, "a count must not be negative");
  return DoSolveGraph(params);
}

}  // namespace retint
