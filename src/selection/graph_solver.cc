// SPDX-License-Identifier: BSD-3-Clause
#include "selection/graph_solver.h"

#include <cstdint>
#include <utility>

#include "base/parallel.h"

namespace retint {
namespace {

constexpr double kTolerance = 1e-3;  // of the residual, relative to the right-hand side
constexpr int kMaxIterations = 300;
constexpr int64_t kGrain = 4096;

double Dot(const std::vector<double>& a, const std::vector<double>& b) {
  return OrderedSum(int64_t(a.size()), kGrain, [&](int64_t begin, int64_t end) {
    double sum = 0;
    for (auto i = size_t(begin); i < size_t(end); ++i) sum += a[i] * b[i];
    return sum;
  });
}

}  // namespace

int SolveGraph(const EdgeMatrix& edges, std::span<const float> weights,
               const std::vector<NodeTerm>& terms, std::vector<double>* x, Monitor& monitor) {
  const size_t count = terms.size();
  const auto each = [&](const auto& body) {
    ParallelRanges(int64_t(count), kGrain, [&](int64_t first, int64_t last) {
      for (auto i = size_t(first); i < size_t(last); ++i) body(i);
    });
  };
  std::vector<double> diagonal(count), residual(count), direction(count), applied(count),
      scaled(count);
  each([&](size_t i) {
    diagonal[i] = terms[i].trust;
    for (size_t e = edges.begin[i]; e < edges.begin[i + 1]; ++e) {
      diagonal[i] += double(weights[e]);
    }
  });
  const auto apply = [&](const std::vector<double>& in, std::vector<double>* out) {
    each([&](size_t i) {
      double sum = 0;
      for (size_t e = edges.begin[i]; e < edges.begin[i + 1]; ++e) {
        sum += double(weights[e]) * in[size_t(edges.other[e])];
      }
      (*out)[i] = diagonal[i] * in[i] - sum;
    });
  };
  apply(*x, &applied);
  double limit = 0;
  for (const NodeTerm& term : terms) limit += term.pull * term.pull;
  limit *= kTolerance * kTolerance;
  each([&](size_t i) {
    residual[i] = terms[i].pull - applied[i];
    direction[i] = scaled[i] = residual[i] / diagonal[i];
  });
  double product = Dot(residual, scaled);
  int iterations = 0;
  while (iterations < kMaxIterations && Dot(residual, residual) > limit) {
    monitor.ThrowIfCancelled();
    apply(direction, &applied);
    const double step = product / Dot(direction, applied);
    each([&](size_t i) {
      (*x)[i] += step * direction[i];
      residual[i] -= step * applied[i];
      scaled[i] = residual[i] / diagonal[i];
    });
    const double before = std::exchange(product, Dot(residual, scaled));
    each([&](size_t i) { direction[i] = scaled[i] + product / before * direction[i]; });
    ++iterations;
  }
  return iterations;
}

}  // namespace retint
