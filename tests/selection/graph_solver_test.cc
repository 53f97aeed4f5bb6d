// SPDX-License-Identifier: BSD-3-Clause
#include "selection/graph_solver.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <utility>

#include <gtest/gtest.h>
#include <Eigen/Sparse>

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
  // Each end is tied to its value like to a neighbor. Nodes in between have almost no term, so x is
  // a line with 22 equal steps from 0 to 1.
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

// A grid, each node joined with the four beside it by weights from 0.001 to 1000.
EdgeMatrix Grid(int side, std::mt19937& random) {
  std::map<std::pair<int, int>, float> weights;
  const auto weight = [&](int a, int b) {
    float& found = weights[std::minmax(a, b)];
    if (found == 0) found = std::pow(10.0f, float(random() % 6001) / 1000 - 3);
    return found;
  };
  EdgeMatrix edges;
  edges.begin.push_back(0);
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      for (const auto& [i, j] : {std::pair{x, y - 1}, {x - 1, y}, {x + 1, y}, {x, y + 1}}) {
        if (i < 0 || j < 0 || i >= side || j >= side) continue;
        edges.other.push_back(j * side + i);
        edges.weight.push_back(weight(y * side + x, j * side + i));
      }
      edges.begin.push_back(edges.other.size());
    }
  }
  return edges;
}

TEST(GraphSolver, ComesCloseToTheSolutionInFewSteps) {
  constexpr int kSide = 100, kCount = kSide * kSide;
  std::mt19937 random(0);
  const EdgeMatrix edges = Grid(kSide, random);
  std::vector<NodeTerm> terms(kCount);
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::VectorXd pull(kCount);
  for (int i = 0; i < kCount; ++i) {
    // A tenth of the nodes know something.
    terms[size_t(i)].Add(0.01, 0.5);
    if (random() % 10 == 0) terms[size_t(i)].Add(10, double(random() % 2));
    double diagonal = terms[size_t(i)].trust;
    pull[i] = terms[size_t(i)].pull;
    for (size_t e = edges.begin[size_t(i)]; e < edges.begin[size_t(i) + 1]; ++e) {
      diagonal += double(edges.weight[e]);
      entries.emplace_back(i, edges.other[e], -double(edges.weight[e]));
    }
    entries.emplace_back(i, i, diagonal);
  }
  Eigen::SparseMatrix<double> matrix(kCount, kCount);
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Eigen::VectorXd exact =
      Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>(matrix).solve(pull);
  std::vector<double> x(kCount, 0.5);
  Monitor monitor;
  const int iterations = SolveGraph(edges, edges.weight, terms, &x, monitor);
  EXPECT_GT(iterations, 0);
  // By the diagonal alone it takes some hundreds.
  EXPECT_LE(iterations, 60);
  const Eigen::Map<const Eigen::VectorXd> found(x.data(), kCount);
  EXPECT_LE((matrix * found - pull).norm(), 1.001e-3 * pull.norm());  // the limit, and rounding
  EXPECT_LE((found - exact).norm(), 0.02 * exact.norm());  // the residual in smooth parts is larger
}

TEST(GraphSolver, SolvesNodesWithoutEdges) {
  constexpr int kCount = 1000;
  EdgeMatrix edges;
  edges.begin.assign(kCount + 1, 0);
  std::vector<NodeTerm> terms(kCount);
  for (int i = 0; i < kCount; ++i) terms[size_t(i)].Add(1 + i % 3, i % 2);
  std::vector<double> x(kCount, 0.5);
  Monitor monitor;
  SolveGraph(edges, edges.weight, terms, &x, monitor);
  for (int i = 0; i < kCount; ++i) EXPECT_NEAR(x[size_t(i)], i % 2, 0.03) << i;  // 1e-3 of |pull|
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
