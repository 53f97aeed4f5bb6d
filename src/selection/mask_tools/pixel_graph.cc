// SPDX-License-Identifier: BSD-3-Clause
#include "selection/mask_tools/pixel_graph.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <queue>
#include <utility>

#include "base/parallel.h"

namespace retint {
namespace {

constexpr double kSmoothness = 10;  // of a border between neighbors alike, in log odds
constexpr double kLeastWeight = 0.01;
constexpr double kValley = 3;        // logarithm of what a valley takes away of it
constexpr double kStepCost = 0.01;   // of a pixel's width, in the distance along surfaces
constexpr double kValleyCost = 0.3;  // of a valley

}  // namespace

template <typename Visit>
void PixelGraph::ForNeighbors(size_t pixel, const Visit& visit) const {
  const int x = int(pixel % size_t(features_.width)), y = int(pixel / size_t(features_.width));
  for (int k = 0; k <= kNeighbors; ++k) {
    const int i = x + k % 3 - 1, j = y + k / 3 - 1;
    if (k == kNeighbors / 2 || !features_.Contains(i, j)) continue;
    const size_t other = size_t(j) * size_t(features_.width) + size_t(i);
    visit(other, (At(pixel) - At(other)).squaredNorm(), k % 2 == 1 ? 1 : std::numbers::sqrt2);
  }
}

PixelGraph::PixelGraph(const PixelArray<float, 4>& features, const ScalarImage& valleys)
    : features_(features), valleys_(valleys) {
  const int64_t width = features.width, height = features.height;
  const double sum = OrderedSum(height, 16, [&](int64_t begin, int64_t end) {
    double part = 0;
    for (auto p = size_t(begin * width); p < size_t(end * width); ++p)
      ForNeighbors(p, [&](size_t, float squared, double) { part += double(squared); });
    return part;
  });
  const int64_t pairs =
      width * (height - 1) + height * (width - 1) + 2 * (width - 1) * (height - 1);
  contrast_ = double(pairs) / std::max(1e-9, sum);  // each pair is in the sum twice
}

double PixelGraph::Valley(size_t from, size_t to) const {
  return double(std::max(valleys_.data[from], valleys_.data[to]));
}

float PixelGraph::Weight(size_t from, size_t to, float squared, double length) const {
  const double alike = std::exp(-contrast_ * double(squared) - kValley * Valley(from, to));
  return float(kSmoothness * std::max(kLeastWeight, alike) / length);
}

float PixelGraph::Step(size_t from, size_t to, float squared, double length) const {
  return float(std::sqrt(double(squared)) + kStepCost * length + kValleyCost * Valley(from, to));
}

FreePixels PixelGraph::Free(const std::vector<Seed>& seeds) const {
  FreePixels free;
  std::vector<int> index(seeds.size(), -1);
  for (size_t p = 0; p < seeds.size(); ++p) {
    if (seeds[p] != Seed::kNone) continue;
    index[p] = int(free.pixels.size());
    free.pixels.push_back(int(p));
  }
  const size_t count = free.pixels.size();
  free.edges.begin.assign(count + 1, 0);
  for (size_t i = 0; i < count; ++i) {
    size_t neighbors = 0;
    ForNeighbors(size_t(free.pixels[i]),
                 [&](size_t other, float, double) { neighbors += index[other] >= 0 ? 1 : 0; });
    free.edges.begin[i + 1] = free.edges.begin[i] + neighbors;
  }
  free.edges.other.resize(free.edges.begin.back());
  free.edges.weight.resize(free.edges.begin.back());
  free.given.assign(count, 0);
  ParallelRanges(int64_t(count), 1024, [&](int64_t begin, int64_t end) {
    for (auto i = size_t(begin); i < size_t(end); ++i) {
      const auto p = size_t(free.pixels[i]);
      size_t e = free.edges.begin[i];
      ForNeighbors(p, [&](size_t other, float squared, double length) {
        const float weight = Weight(p, other, squared, length);
        if (index[other] < 0) {
          free.given[i] += seeds[other] == Seed::kInside ? weight : -weight;
        } else {
          free.edges.other[e] = index[other];
          free.edges.weight[e++] = weight;
        }
      });
    }
  });
  return free;
}

std::vector<float> PixelGraph::DistancesFrom(const std::vector<Seed>& seeds, Seed kind) const {
  std::vector<float> distances(seeds.size(), std::numeric_limits<float>::infinity());
  using Entry = std::pair<float, int>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  size_t wanted = 0;
  for (size_t p = 0; p < seeds.size(); ++p) {
    wanted += seeds[p] == Seed::kNone ? 1 : 0;
    if (seeds[p] != kind) continue;
    distances[p] = 0;
    bool leaves = false;  // a way out of the seeds starts here
    ForNeighbors(p, [&](size_t other, float, double) { leaves |= seeds[other] != kind; });
    if (leaves) open.emplace(0.0f, int(p));
  }
  while (!open.empty() && wanted > 0) {
    const auto [distance, pixel] = open.top();
    const auto p = size_t(pixel);
    open.pop();
    if (distance > distances[p]) continue;
    wanted -= seeds[p] == Seed::kNone ? 1 : 0;
    ForNeighbors(p, [&, from = distance](size_t other, float squared, double length) {
      const float longer = from + Step(p, other, squared, length);
      if (longer < distances[other]) {
        distances[other] = longer;
        open.emplace(longer, int(other));
      }
    });
  }
  return distances;
}

}  // namespace retint
