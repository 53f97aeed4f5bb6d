// SPDX-License-Identifier: BSD-3-Clause
#include "selection/mask_tools/pixel_graph.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include <Eigen/Core>

#include "base/parallel.h"

namespace retint {
namespace {

constexpr double kSmoothness = 10;  // weight of a border between equal neighbors, in log odds
constexpr double kLeastWeight = 0.01;
constexpr double kValley = 3;       // a sure crease multiplies it by exp(-kValley)
constexpr double kStepCost = 0.01;  // length of a step of one pixel, in the distance along surfaces
constexpr float kInfinity = std::numeric_limits<float>::infinity();

// A queue by distance (Dial 1969). Every step is longer than a bucket is wide. So nothing
// is added to the first bucket that is not empty, and its entries have their final
// distance.
class Buckets {
 public:
  struct Entry {
    float distance;
    int pixel;
  };

  void Add(float distance, int pixel) {
    const auto at = size_t(double(distance) / kWidth);
    if (at >= buckets_.size()) buckets_.resize(at + 1 + at / 2);
    buckets_[at].push_back({distance, pixel});
  }
  size_t size() const { return buckets_.size(); }
  std::vector<Entry> Take(size_t at) { return std::exchange(buckets_[at], {}); }

 private:
  static constexpr double kWidth = 0.9 * kStepCost;

  std::vector<std::vector<Entry>> buckets_;
};

}  // namespace

template <typename Visit>
void PixelGraph::ForNeighbors(size_t pixel, const Visit& visit) const {
  const int width = squared_.width;
  const int x = int(pixel % size_t(width)), y = int(pixel / size_t(width));
  for (int k = 0; k < kWindow; ++k) {
    const int i = x + k % 3 - 1, j = y + k / 3 - 1;
    if (k == kWindow / 2 || !squared_.Contains(i, j)) continue;
    visit(size_t(j) * size_t(width) + size_t(i), squared_.data[size_t(kWindow) * pixel + size_t(k)],
          k % 2 == 1 ? 1 : std::numbers::sqrt2);
  }
}

PixelGraph::PixelGraph(const PixelArray<float, 4>& features, const ScalarImage& valleys,
                       double valley_cost)
    : valleys_(valleys), valley_cost_(valley_cost), squared_(features.width, features.height) {
  const int width = features.width, height = features.height;
  const auto at = [&](int x, int y) { return Eigen::Map<const Eigen::Vector4f>(&features(x, y)); };
  const double sum = OrderedSum(height, 16, [&](int64_t begin, int64_t end) {
    double part = 0;
    for (int y = int(begin); y < int(end); ++y) {
      for (int x = 0; x < width; ++x) {
        for (int k = 0; k < kWindow; ++k) {
          const int i = x + k % 3 - 1, j = y + k / 3 - 1;
          if (!features.Contains(i, j)) continue;
          const float squared = (at(x, y) - at(i, j)).squaredNorm();
          squared_(x, y, k) = squared;
          part += double(squared);
        }
      }
    }
    return part;
  });
  const int64_t across = int64_t(width - 1) * (height - 1);
  const int64_t pairs = int64_t(width) * (height - 1) + int64_t(height) * (width - 1) + 2 * across;
  contrast_ = double(pairs) / std::max(1e-9, sum);  // the sum has each pair twice
}

double PixelGraph::Valley(size_t from, size_t to) const {
  return double(std::max(valleys_.data[from], valleys_.data[to]));
}

float PixelGraph::Weight(size_t from, size_t to, float squared, double length) const {
  const double alike = std::exp(-contrast_ * double(squared) - kValley * Valley(from, to));
  return float(kSmoothness * std::max(kLeastWeight, alike) / length);
}

float PixelGraph::Step(size_t from, size_t to, float squared, double length) const {
  return float(std::sqrt(double(squared)) + kStepCost * length + valley_cost_ * Valley(from, to));
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
  free.steps.resize(free.edges.begin.back());
  free.given.assign(count, 0);
  free.to_inside.assign(count, kInfinity);
  free.to_outside.assign(count, kInfinity);
  ParallelRanges(int64_t(count), 1024, [&](int64_t begin, int64_t end) {
    for (auto i = size_t(begin); i < size_t(end); ++i) {
      const auto p = size_t(free.pixels[i]);
      size_t e = free.edges.begin[i];
      ForNeighbors(p, [&](size_t other, float squared, double length) {
        const float weight = Weight(p, other, squared, length);
        const float step = Step(p, other, squared, length);
        if (index[other] >= 0) {
          free.edges.other[e] = index[other];
          free.edges.weight[e] = weight;
          free.steps[e++] = step;
          return;
        }
        const bool inside = seeds[other] == Seed::kInside;
        free.given[i] += inside ? weight : -weight;
        float& least = inside ? free.to_inside[i] : free.to_outside[i];
        least = std::min(least, step);
      });
    }
  });
  return free;
}

std::vector<float> FreePixels::DistancesTo(Seed kind) const {
  std::vector<float> distances = kind == Seed::kInside ? to_inside : to_outside;
  Buckets open;
  for (size_t i = 0; i < distances.size(); ++i) {
    if (std::isfinite(distances[i])) open.Add(distances[i], int(i));
  }
  for (size_t at = 0; at < open.size(); ++at) {
    for (const Buckets::Entry& entry : open.Take(at)) {
      const auto i = size_t(entry.pixel);
      if (entry.distance > distances[i]) continue;
      for (size_t e = edges.begin[i]; e < edges.begin[i + 1]; ++e) {
        const float longer = entry.distance + steps[e];
        float& known = distances[size_t(edges.other[e])];
        if (longer >= known) continue;
        known = longer;
        open.Add(longer, edges.other[e]);
      }
    }
  }
  return distances;
}

}  // namespace retint
