// SPDX-License-Identifier: BSD-3-Clause
// Values over the nodes of a graph that agree with their neighbors and with known terms.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "base/monitor.h"
#include "kernels/backend.h"

namespace retint {

// The edges of a graph as a symmetric matrix without diagonal, row by row.
struct EdgeMatrix {
  std::vector<size_t> begin;  // [nodes + 1] into what follows
  std::vector<int> other;     // ascending within a row
  std::vector<float> weight;  // above 0
};

// The same in a device's memory.
struct DeviceEdges {
  Buffer<int32_t> begin, other;
  Buffer<float> weight;
};
// Whether SolveGraphOnDevice can take so many edges.
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

// The x that minimizes  sum_edges w_ij (x_i - x_j)^2 + sum_i terms_i(x_i)  (random walker with
// priors, Grady 2005), by conjugate gradients (Saad 2003, algorithm 9.1) from *x on, preconditioned
// by a hierarchy of coarser graphs. Every node has a term of trust above 0. Ends at a residual of
// 0.001 of the right-hand side, and in any case after 300 iterations: then x is still a valid
// start, and closer than it was. Returns the iterations taken; the same result on any number of
// threads. Cancelled between iterations. `weights` stand for those of `edges`; 0 is as no edge.
int SolveGraph(const EdgeMatrix& edges, std::span<const float> weights,
               const std::vector<NodeTerm>& terms, std::vector<double>* x, Monitor& monitor);

// The same on a device (kernels/graph_ops.h), to the same residual; `weights` are in its memory.
int SolveGraphOnDevice(const DeviceEdges& edges, const Buffer<float>& weights,
                       const std::vector<NodeTerm>& terms, std::vector<double>* x,
                       Backend& backend);

}  // namespace retint
