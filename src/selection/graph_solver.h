// SPDX-License-Identifier: BSD-3-Clause
// Values on the nodes of a graph that agree with their neighbors and with known values.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "base/monitor.h"
#include "kernels/backend.h"

namespace retint {

// The edges of a graph as a symmetric matrix without diagonal, row by row.
struct EdgeMatrix {
  std::vector<size_t> begin;  // [nodes + 1], into the next two
  std::vector<int> other;     // ascending within a row
  std::vector<float> weight;  // above 0
};

// The same in a device's memory.
struct DeviceEdges {
  Buffer<int32_t> begin, other;
  Buffer<float> weight;
};
// Whether SolveGraphOnDevice() can hold this many edges.
bool FitsDevice(const EdgeMatrix& edges, Backend* backend);
DeviceEdges UploadEdges(const EdgeMatrix& edges, Backend& backend);

// The cost of one node: sum_i trust (x - value)^2 of its terms. Kept as sums.
struct NodeTerm {
  double trust = 0, pull = 0;  // sums of trust and of trust times value

  void Add(double more_trust, double value) {
    trust += more_trust;
    pull += more_trust * value;
  }
};

// Finds the x that minimizes  sum_edges w_ij (x_i - x_j)^2 + sum_i terms_i(x_i)  (random walker
// with priors, Grady 2005). Conjugate gradients (Saad 2003, algorithm 9.1) start from *x, with a
// hierarchy of coarser graphs as preconditioner. Every node needs a term of trust above 0. Stops at
// a residual of 0.001 of the right-hand side, or after 300 iterations, when x is closer than at the
// start. Returns the iterations; the result does not depend on the number of threads. Cancelled
// between iterations. `weights` replace those of `edges`; 0: no edge.
int SolveGraph(const EdgeMatrix& edges, std::span<const float> weights,
               const std::vector<NodeTerm>& terms, std::vector<double>* x, Monitor& monitor);

// The same on a device (kernels/graph_ops.h), to the same residual. `weights` are in device memory.
int SolveGraphOnDevice(const DeviceEdges& edges, const Buffer<float>& weights,
                       const std::vector<NodeTerm>& terms, std::vector<double>* x,
                       Backend& backend);

}  // namespace retint
