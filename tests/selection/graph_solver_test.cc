// SPDX-License-Identifier: BSD-3-Clause
#include "selection/graph_solver.h"

#include <gtest/gtest.h>

#include "base/error.h"

namespace retint {
namespace {

// A chain of nodes, each joined with the next by a weight of 1.
EdgeMatrix Chain(int count) {
  EdgeMatrix edges;
  edges.begin.push_back(0);
  for (int i = 0; i < count; ++i) {
    for (const int other : {i - 1, i + 1}) {
      if (other < 0 || other >= count) continue;
      edges.other.push_back(other);
      edges.weight.push_back(1);
    }
    edges.begin.push_back(edges.other.size());
  }
  return edges;
}

TEST(GraphSolver, InterpolatesBetweenWhatIsKnown) {
  // Each end is tied to its value as to a neighbor; what lies between has next to no term, and is a
  // line: 22 equal steps from 0 to 1.
  constexpr int kCount = 21;
  const EdgeMatrix edges = Chain(kCount);
  std::vector<NodeTerm> terms(kCount);
  for (NodeTerm& term : terms) term.Add(1e-9, 0.5);
  terms.front().Add(1, 0);
  terms.back().Add(1, 1);
  std::vector<double> x(kCount, 0.5);
  Monitor monitor;
  EXPECT_GT(SolveGraph(edges, edges.weight, terms, &x, monitor), 0);
  for (int i = 0; i < kCount; ++i) {
    // The residual ends at 0.001, and the least eigenvalue is (pi / 22)^2 = 0.02.
    EXPECT_NEAR(x[size_t(i)], (i + 1) / 22.0, 0.05) << i;
  }
}

TEST(GraphSolver, OfOneNodeIsTheMeanOfItsTerms) {
  const EdgeMatrix edges = Chain(1);
  std::vector<NodeTerm> terms(1);
  terms[0].Add(3, 1);
  terms[0].Add(1, 0);
  std::vector<double> x = {0};
  Monitor monitor;
  SolveGraph(edges, edges.weight, terms, &x, monitor);
  EXPECT_NEAR(x[0], 0.75, 1e-12);  // one step of conjugate gradients is exact
}

TEST(GraphSolver, AWeightOfZeroIsNoEdge) {
  const EdgeMatrix edges = Chain(4);
  std::vector<float> weights = edges.weight;
  for (size_t node = 0; node < 4; ++node) {
    for (size_t e = edges.begin[node]; e < edges.begin[node + 1]; ++e) {
      if ((node < 2) != (edges.other[e] < 2)) weights[e] = 0;
    }
  }
  std::vector<NodeTerm> terms(4);
  for (size_t node = 0; node < 4; ++node) terms[node].Add(1, node < 2 ? 1 : 0);
  std::vector<double> x(4, 0.5);
  Monitor monitor;
  SolveGraph(edges, weights, terms, &x, monitor);
  EXPECT_NEAR(x[1], 1, 1e-3);  // the residual's limit
  EXPECT_NEAR(x[2], 0, 1e-3);
}

TEST(GraphSolver, StartsFromASolutionWithoutAStep) {
  const EdgeMatrix edges = Chain(5);
  std::vector<NodeTerm> terms(5);
  for (NodeTerm& term : terms) term.Add(1, 1);
  std::vector<double> x(5, 1.0);
  Monitor monitor;
  EXPECT_EQ(SolveGraph(edges, edges.weight, terms, &x, monitor), 0);
  monitor.Cancel();
  x.assign(5, 0);
  EXPECT_THROW(SolveGraph(edges, edges.weight, terms, &x, monitor), Cancelled);
}

}  // namespace
}  // namespace retint
