// SPDX-License-Identifier: BSD-3-Clause
// The solution over a graph against a sparse factorization in double precision.
#include <cmath>
#include <cstring>
#include <map>
#include <stdexcept>

#include <Eigen/Sparse>

#include "tests/kernels/test_scene.h"

namespace retint {
namespace {

// Nodes joined at random, each with about `degree` others, by weights from 0.001 to 1000.
struct TestGraph {
  std::vector<int32_t> begin = {0}, other;
  std::vector<float> weight;
  std::vector<double> trust, pull;

  TestGraph(std::mt19937& rng, int nodes, int degree) {
    std::vector<std::map<int, float>> rows{size_t(nodes)};
    for (int i = 0; nodes > 1 && i < nodes * degree / 2; ++i) {
      // Most join close numbers, so that the graph is wide and its solution takes many steps.
      const int a = int(rng() % unsigned(nodes));
      const int b = (a + 1 + int(rng() % 9)) % nodes;
      if (a == b) continue;
      rows[size_t(a)][b] = rows[size_t(b)][a] = std::pow(10.0f, Uniform(rng, -3, 3));
    }
    for (const auto& row : rows) {
      for (const auto& [to, by] : row) other.push_back(to), weight.push_back(by);
      begin.push_back(int32_t(other.size()));
      trust.push_back(double(Uniform(rng, 0.5f, 10)));
      pull.push_back(trust.back() * double(Uniform(rng, 0, 1)));
    }
  }

  std::vector<double> Exact() const {
    const auto nodes = int(trust.size());
    std::vector<Eigen::Triplet<double>> entries;
    for (int i = 0; i < nodes; ++i) {
      double diagonal = trust[size_t(i)];
      for (int e = begin[size_t(i)]; e < begin[size_t(i) + 1]; ++e) {
        diagonal += double(weight[size_t(e)]);
        entries.emplace_back(i, other[size_t(e)], -double(weight[size_t(e)]));
      }
      entries.emplace_back(i, i, diagonal);
    }
    Eigen::SparseMatrix<double> matrix(nodes, nodes);
    matrix.setFromTriplets(entries.begin(), entries.end());
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(matrix);
    const Eigen::VectorXd x = factor.solve(Eigen::Map<const Eigen::VectorXd>(pull.data(), nodes));
    return {x.begin(), x.end()};
  }
};

class GraphOp : public BackendTest {
 protected:
  void SetUp() override {
    BackendTest::SetUp();
    if (!IsSkipped() && !backend_->graph()) GTEST_SKIP() << "the backend has no graphs";
  }
  struct Solution {
    std::vector<double> x;
    int iterations;
  };
  static Solution Solve(Backend& backend, const TestGraph& graph, const std::vector<double>& start,
                        double tolerance, int most = 10000) {
    Guarded<int32_t> begin(backend, graph.begin), other(backend, graph.other);
    Guarded<float> weight(backend, graph.weight);
    Guarded<double> trust(backend, graph.trust), pull(backend, graph.pull), x(backend, start);
    const int iterations = backend.graph()->SolveGraph({begin.data(), other.data(), weight.data(),
                                                        trust.data(), pull.data(), x.data(),
                                                        int64_t(start.size()), tolerance, most});
    return {x.Read(), iterations};
  }
};

TEST_P(GraphOp, WeighsEdgesByWhatTheirEndsLookLike) {
  for (const auto& [nodes, degree] : {std::pair{1, 0}, {17, 4}, {5003, 20}}) {
    const TestGraph graph(rng_, nodes, degree);
    std::vector<NodeLook> looks;
    for (int i = 0; i < nodes; ++i) looks.push_back({Uniform(rng_, 0, 1), Uniform(rng_, 0, 1)});
    Guarded<int32_t> begin(*backend_, graph.begin), other(*backend_, graph.other);
    Guarded<float> weight(*backend_, graph.weight), out(*backend_, graph.weight.size());
    Guarded<NodeLook> device_looks(*backend_, looks);
    backend_->graph()->WeighEdges({begin.data(), other.data(), weight.data(), device_looks.data(),
                                   out.data(), nodes, 1000, 1e-6f});
    const std::vector<float> found = out.Read();
    for (size_t i = 0; i < size_t(nodes); ++i) {
      for (auto e = size_t(graph.begin[i]); e < size_t(graph.begin[i + 1]); ++e) {
        const NodeLook &a = looks[i], &b = looks[size_t(graph.other[e])];
        const double alike = 1 - std::abs(double(a.prior) - double(b.prior));
        const double kept = alike * alike * double(std::min(a.open, b.open));
        const double expected = 1000 * (double(graph.weight[e]) * kept + 1e-6);
        EXPECT_NEAR(found[e], expected, 1e-5 * expected) << i;
      }
    }
  }
}

TEST_P(GraphOp, SolvesLikeAFactorization) {
  for (const auto& [nodes, degree] : {std::pair{1, 0}, {2, 2}, {17, 4}, {33, 0}, {20011, 20}}) {
    const TestGraph graph(rng_, nodes, degree);
    const std::vector<double> exact = graph.Exact();
    const Solution found = Solve(*backend_, graph, std::vector<double>(size_t(nodes), 0.5), 1e-10);
    EXPECT_GT(found.iterations, 0);
    EXPECT_LT(found.iterations, 10000);
    double worst = 0;
    for (size_t i = 0; i < exact.size(); ++i) {
      worst = std::max(worst, std::abs(found.x[i] - exact[i]));
    }
    // The residual is at most 1e-10 of |pull|, itself at most 10 sqrt(nodes), and the least
    // eigenvalue is at least the least trust, 0.5.
    EXPECT_LE(worst, 1e-10 * 10 * std::sqrt(double(nodes)) / 0.5) << nodes;
  }
}

TEST_P(GraphOp, StartsFromASolutionWithoutAStep) {
  const TestGraph graph(rng_, 5000, 12);
  const Solution found = Solve(*backend_, graph, graph.Exact(), 1e-8);
  EXPECT_EQ(found.iterations, 0);
}

TEST_P(GraphOp, StopsAtItsLimit) {
  const TestGraph graph(rng_, 5000, 12);
  const std::vector<double> start(5000, 0.25);
  const Solution none = Solve(*backend_, graph, start, 1e-10, 0);
  EXPECT_EQ(none.x, start);
  EXPECT_EQ(none.iterations, 0);
  const Solution some = Solve(*backend_, graph, start, 1e-10, 7);
  EXPECT_EQ(some.iterations, 7);
  EXPECT_NE(some.x, start);
}

TEST_P(GraphOp, GivesTheSameBytesAgain) {
  const TestGraph graph(rng_, 30000, 20);
  const std::vector<double> start(30000, 0.5);
  const Solution first = Solve(*backend_, graph, start, 1e-6);
  for (int run = 0; run < 2; ++run) {
    const Solution again = Solve(*MakeBackend(GetParam()), graph, start, 1e-6);
    EXPECT_EQ(again.iterations, first.iterations);
    EXPECT_EQ(std::memcmp(again.x.data(), first.x.data(), first.x.size() * sizeof(double)), 0);
  }
}

TEST_P(GraphOp, OfNoPullIsZero) {
  TestGraph graph(rng_, 100, 6);
  graph.pull.assign(100, 0);
  for (const double x : Solve(*backend_, graph, std::vector<double>(100, 1.0), 1e-3, 500).x) {
    EXPECT_NEAR(x, 0, 1e-12);  // as far as 500 steps of double precision get
  }
}

TEST_P(GraphOp, RefusesWhatCannotBe) {
  EXPECT_THROW(
      backend_->graph()->WeighEdges({nullptr, nullptr, nullptr, nullptr, nullptr, -1, 1, 0}),
      std::invalid_argument);
  backend_->graph()->WeighEdges({nullptr, nullptr, nullptr, nullptr, nullptr, 0, 1, 0});
  EXPECT_THROW(backend_->graph()->SolveGraph(
                   {nullptr, nullptr, nullptr, nullptr, nullptr, nullptr, -1, 1e-3, 10}),
               std::invalid_argument);
  EXPECT_THROW(backend_->graph()->SolveGraph(
                   {nullptr, nullptr, nullptr, nullptr, nullptr, nullptr, 1, 0, 10}),
               std::invalid_argument);
  EXPECT_EQ(backend_->graph()->SolveGraph(
                {nullptr, nullptr, nullptr, nullptr, nullptr, nullptr, 0, 1e-3, 10}),
            0);
}

RETINT_INSTANTIATE(GraphOp);

}  // namespace
}  // namespace retint
