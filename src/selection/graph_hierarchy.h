// SPDX-License-Identifier: BSD-3-Clause
// A multigrid preconditioner for the linear system in graph_solver.h.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace retint {

// The symmetric matrix A of a graph, row by row: A_ii = trust_i + sum_j w_ij and A_ij = -w_ij.
struct GraphMatrix {
  std::span<const size_t> begin;  // [nodes + 1], into the next two
  std::span<const int> other;     // ascending within a row
  std::span<const float> weight;  // 0 or more; 0: no edge
  std::vector<double> trust;      // [nodes], above 0
  std::vector<double> diagonal;   // [nodes]

  GraphMatrix() = default;
  GraphMatrix(std::span<const size_t> begins, std::span<const int> others,
              std::span<const float> weights, std::vector<double> trusts);
  size_t size() const { return diagonal.size(); }
  // A x of row i.
  double Row(size_t i, const std::vector<double>& x) const {
    double sum = 0;
    for (size_t e = begin[i]; e < begin[i + 1]; ++e) {
      sum += double(weight[e]) * x[size_t(other[e])];
    }
    return diagonal[i] * x[i] - sum;
  }
};

// Multigrid by aggregation without smoothing (Vanek, Mandel and Brezina 1996; Notay 2010). Nodes
// with strong edges between them become one node of the next coarser graph, until few are left.
// Their trusts and weights are added up. One V-cycle approximates A^-1 r, with a damped Jacobi step
// before and after each coarser correction. It is symmetric and positive definite, as conjugate
// gradients require. The result does not depend on the number of threads.
class GraphHierarchy {
 public:
  // The arrays behind the spans of `finest` must outlive this.
  explicit GraphHierarchy(GraphMatrix finest);
  const GraphMatrix& finest() const { return levels_.front().matrix; }
  // *x = about A^-1 r.
  void Apply(const std::vector<double>& r, std::vector<double>* x) { Cycle(0, r, x); }

 private:
  struct Level {
    GraphMatrix matrix;
    // Of coarser graphs: the arrays behind the spans of `matrix`.
    std::vector<size_t> begin;
    std::vector<int> other;
    std::vector<float> weight;
    // To the next coarser graph: for each node, the coarser node that it is part of, or -1; for
    // each coarser node, its members, ascending.
    std::vector<int> part_of;
    std::vector<size_t> members_begin;
    std::vector<int> members;
    std::vector<double> rest, corrected;  // buffers of a cycle: of this level; of the next coarser
  };
  void Cycle(size_t level, const std::vector<double>& r, std::vector<double>* x);
  static bool Aggregate(Level* level);
  static Level Coarsen(const Level& fine);

  std::vector<Level> levels_;
};

}  // namespace retint
