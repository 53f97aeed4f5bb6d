// SPDX-License-Identifier: BSD-3-Clause
#include "scene/morton.h"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "base/parallel.h"

namespace retint {
namespace {

constexpr int kBits = 21;  // an axis; three fit into 64
constexpr double kCells = 1 << kBits;
constexpr int64_t kGrain = 8192;

// The bits of `cell`, two zeros after each.
uint64_t Spread(uint64_t cell) {
  uint64_t bits = 0;
  for (int i = 0; i < kBits; ++i) bits |= ((cell >> i) & 1u) << (3 * i);
  return bits;
}

}  // namespace

std::vector<uint32_t> MortonOrder(std::span<const float> points) {
  const size_t count = points.size() / 3;
  std::array<double, 3> low, scale;
  for (size_t i = 0; i < 3; ++i) {
    double least = std::numeric_limits<double>::max(), most = -least;
    for (size_t g = 0; g < count; ++g) {
      least = std::min<double>(least, points[g * 3 + i]);
      most = std::max<double>(most, points[g * 3 + i]);
    }
    low[i] = least;
    scale[i] = most > least ? kCells / (most - least) : 0;
  }
  std::vector<std::pair<uint64_t, uint32_t>> coded(count);
  ParallelRanges(int64_t(count), kGrain, [&](int64_t begin, int64_t end) {
    for (auto g = size_t(begin); g < size_t(end); ++g) {
      uint64_t code = 0;
      for (size_t i = 0; i < 3; ++i) {
        const double cell = std::min(kCells - 1, (points[g * 3 + i] - low[i]) * scale[i]);
        code |= Spread(static_cast<uint64_t>(cell)) << i;
      }
      coded[g] = {code, uint32_t(g)};
    }
  });
  std::sort(coded.begin(), coded.end());
  std::vector<uint32_t> order(count);
  for (size_t i = 0; i < count; ++i) order[i] = coded[i].second;
  return order;
}

}  // namespace retint
