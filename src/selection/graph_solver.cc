// SPDX-License-Identifier: BSD-3-Clause
#include "selection/graph_solver.h"

#include <cstdint>
#include <limits>
#include <utility>

#include "base/parallel.h"
#include "selection/graph_hierarchy.h"

namespace retint {
namespace {

constexpr double kTolerance = 1e-3;  // of the residual, relative to the right-hand side
constexpr int kMaxIterations = 300;
constexpr int kMaxDeviceIterations = 5000;  // which are many more, and far cheaper
constexpr int64_t kGrain = 4096;

double Dot(const std::vector<double>& a, const std::vector<double>& b) {
  return OrderedSum(int64_t(a.size()), kGrain, [&](int64_t begin, int64_t end) {
    double sum = 0;
    for (auto i = size_t(begin); i < size_t(end); ++i) sum += a[i] * b[i];
    return sum;
  });
}

// On a device: all of what is known of the graph goes there, and x comes back.
int SolveOnDevice(const EdgeMatrix& edges, std::span<const float> weights,
                  const std::vector<NodeTerm>& terms, std::vector<double>* x, Backend& backend) {
  const size_t count = terms.size();
  std::vector<int32_t> begin(count + 1);
  std::vector<double> trust(count), pull(count);
  ParallelRanges(int64_t(count), kGrain, [&](int64_t first, int64_t last) {
    for (auto i = size_t(first); i < size_t(last); ++i) {
      begin[i + 1] = int32_t(edges.begin[i + 1]);
      trust[i] = terms[i].trust;
      pull[i] = terms[i].pull;
    }
  });
  const auto begins = backend.Upload(std::span<const int32_t>(begin));
  const auto others = backend.Upload(std::span<const int32_t>(edges.other));
  const auto device_weights = backend.Upload(weights);
  const auto trusts = backend.Upload(std::span<const double>(trust));
  const auto pulls = backend.Upload(std::span<const double>(pull));
  const auto solved = backend.Upload(std::span<const double>(*x));
  const int iterations = backend.graph()->SolveGraph(
      {begins.data(), others.data(), device_weights.data(), trusts.data(), pulls.data(),
       solved.data(), int64_t(count), kTolerance, kMaxDeviceIterations});
  backend.CopyToHost(x->data(), solved.data(), count * sizeof(double));
  return iterations;
}

}  // namespace

int SolveGraph(const EdgeMatrix& edges, std::span<const float> weights,
               const std::vector<NodeTerm>& terms, std::vector<double>* x, Monitor& monitor,
               Backend* backend) {
  monitor.ThrowIfCancelled();
  constexpr size_t kMostEdges = std::numeric_limits<int32_t>::max();
  if (backend && backend->graph() && weights.size() <= kMostEdges) {
    return SolveOnDevice(edges, weights, terms, x, *backend);
  }
  const size_t count = terms.size();
  const auto each = [&](const auto& body) {
    ParallelRanges(int64_t(count), kGrain, [&](int64_t first, int64_t last) {
      for (auto i = size_t(first); i < size_t(last); ++i) body(i);
    });
  };
  std::vector<double> trust(count), residual(count), direction(count), applied(count),
      scaled(count);
  each([&](size_t i) { trust[i] = terms[i].trust; });
  GraphHierarchy hierarchy({edges.begin, edges.other, weights, std::move(trust)});
  const GraphMatrix& matrix = hierarchy.finest();
  double limit = 0;
  for (const NodeTerm& term : terms) limit += term.pull * term.pull;
  limit *= kTolerance * kTolerance;
  each([&](size_t i) { residual[i] = terms[i].pull - matrix.Row(i, *x); });
  double product = 0;
  int iterations = 0;
  while (iterations < kMaxIterations && Dot(residual, residual) > limit) {
    monitor.ThrowIfCancelled();
    hierarchy.Apply(residual, &scaled);
    const double before = std::exchange(product, Dot(residual, scaled));
    const double kept = iterations == 0 ? 0 : product / before;
    each([&](size_t i) { direction[i] = scaled[i] + kept * direction[i]; });
    each([&](size_t i) { applied[i] = matrix.Row(i, direction); });
    const double step = product / Dot(direction, applied);
    each([&](size_t i) {
      (*x)[i] += step * direction[i];
      residual[i] -= step * applied[i];
    });
    ++iterations;
  }
  return iterations;
}

}  // namespace retint
