// SPDX-License-Identifier: BSD-3-Clause
#include "kernels/graph_ops.h"

#include <limits>

#include "kernels/check.h"

namespace retint {

namespace {

void RequireNodes(int64_t nodes) {
  RequireCount(nodes);
  Require(nodes < std::numeric_limits<int32_t>::max(), "nodes of a graph: below 2^31 - 1");
}

}  // namespace

void GraphOps::WeighEdges(const WeighEdgesParams& params) {
  RequireNodes(params.nodes);
  if (params.nodes > 0) DoWeighEdges(params);
}

int GraphOps::SolveGraph(const SolveGraphParams& params) {
  RequireNodes(params.nodes);
  Require(params.tolerance > 0, "the tolerance of a solution must be above 0");
  Require(params.max_iterations >= 0, "a count must not be negative");
  return DoSolveGraph(params);
}

}  // namespace retint
