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
constexpr int kMaxDeviceIterations = 5000;  // many more, but each is far cheaper
constexpr int64_t kGrain = 4096;

double Dot(const std::vector<double>& a, const std::vector<double>& b) {
  return OrderedSum(int64_t(a.size()), kGrain, [&](int64_t begin, int64_t end) {
    double sum = 0;
    for (auto i = size_t(begin); i < size_t(end); ++i) sum += a[i] * b[i];
    return sum;
  });
}

}  // namespace

bool FitsDevice(const EdgeMatrix& edges, Backend* backend) {
  constexpr size_t kMostEdges = std::numeric_limits<int32_t>::max();
  return backend && backend->graph() && edges.other.size() <= kMostEdges;
}

DeviceEdges UploadEdges(const EdgeMatrix& edges, Backend& backend) {
  std::vector<int32_t> begin(edges.begin.size());
  ParallelRanges(int64_t(begin.size()), kGrain, [&](int64_t first, int64_t last) {
    for (auto i = size_t(first); i < size_t(last); ++i) begin[i] = int32_t(edges.begin[i]);
  });
  return {backend.Upload(std::span<const int32_t>(begin)),
          backend.Upload(std::span<const int32_t>(edges.other)),
          backend.Upload(std::span<const float>(edges.weight))};
}

int SolveGraphOnDevice(const DeviceEdges& edges, const Buffer<float>& weights,
                       const std::vector<NodeTerm>& terms, std::vector<double>* x,
                       Backend& backend) {
  const size_t count = terms.size();
  std::vector<double> values(3 * count);  // trust, pull and x
  ParallelRanges(int64_t(count), kGrain, [&](int64_t first, int64_t last) {
    for (auto i = size_t(first); i < size_t(last); ++i) {
      values[i] = terms[i].trust;
      values[count + i] = terms[i].pull;
      values[2 * count + i] = (*x)[i];
    }
  });
  const auto device = backend.Upload(std::span<const double>(values));
  double* const solved = device.data() + 2 * count;
  const int iterations = backend.graph()->SolveGraph(
      {edges.begin.data(), edges.other.data(), weights.data(), device.data(), device.data() + count,
       solved, int64_t(count), kTolerance, kMaxDeviceIterations});
  backend.CopyToHost(x->data(), solved, count * sizeof(double));
  return iterations;
}

int SolveGraph(const EdgeMatrix& edges, std::span<const float> weights,
               const std::vector<NodeTerm>& terms, std::vector<double>* x, Monitor& monitor) {
  monitor.ThrowIfCancelled();
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
