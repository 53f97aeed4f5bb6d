// SPDX-License-Identifier: BSD-3-Clause
// Values over the nodes of a graph, for a device. On the host another preconditioner is the faster
// one (selection/graph_solver.h), and the backend has no such group.
#pragma once

#include <cstdint>

#include "kernels/common/graph.h"

namespace retint {

// out_e = scale * (WeightBetween(looks of the edge's ends, weight_e) + least).
struct WeighEdgesParams {
  const int32_t* begin;   // [nodes + 1] where a node's edges begin; begin[0] = 0
  const int32_t* other;   // [edges] the node at the other end
  const float* weight;    // [edges]
  const NodeLook* looks;  // [nodes]
  float* out;             // [edges]
  int64_t nodes;
  float scale, least;
};

// Finds the x that minimizes  sum_edges w_ij (x_i - x_j)^2 + sum_i (trust_i x_i^2 - 2 pull_i x_i),
// starting from x. Conjugate gradients, preconditioned by the diagonal, with one round of sums an
// iteration (Chronopoulos and Gear 1989), in double precision. It ends when the residual is
// `tolerance` times the right-hand side `pull`, or after `max_iterations`.
struct SolveGraphParams {
  const int32_t* begin;  // [nodes + 1] where a node's edges begin; begin[0] = 0
  const int32_t* other;  // [edges] the node at the other end; an edge is there from both its ends
  const float* weight;   // [edges], 0 or more, the same from both ends
  const double* trust;   // [nodes], above 0
  const double* pull;    // [nodes]
  double* x;             // [nodes]
  int64_t nodes;
  double tolerance;
  int32_t max_iterations;
};

class GraphOps {
 public:
  virtual ~GraphOps() = default;
  void WeighEdges(const WeighEdgesParams& params);
  // The iterations taken.
  int SolveGraph(const SolveGraphParams& params);

 protected:
  virtual void DoWeighEdges(const WeighEdgesParams& params) = 0;
  virtual int DoSolveGraph(const SolveGraphParams& params) = 0;
};

}  // namespace retint
