// SPDX-License-Identifier: BSD-3-Clause
#include "splat_io/morton.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>

namespace retint {
namespace {

constexpr int kBits = 21;  // an axis; three fit into 64
constexpr double kCells = 1 << kBits;

// The bits of `cell`, two zeros after each.
uint64_t Spread(uint64_t cell) {
  uint64_t bits = 0;
  for (int i = 0; i < kBits; ++i) bits |= ((cell >> i) & 1u) << (3 * i);
  return bits;
}

}  // namespace

std::vector<uint32_t> MortonOrder(const GaussianModel& model) {
  const size_t count = model.NumGaussians();
  std::array<double, 3> low, scale;
  for (size_t i = 0; i < 3; ++i) {
    double least = std::numeric_limits<double>::max(), most = -least;
    for (size_t g = 0; g < count; ++g) {
      least = std::min<double>(least, model.means[g * 3 + i]);
      most = std::max<double>(most, model.means[g * 3 + i]);
    }
    low[i] = least;
    scale[i] = most > least ? kCells / (most - least) : 0;
  }
  std::vector<uint64_t> codes(count);
  for (size_t g = 0; g < count; ++g) {
    for (size_t i = 0; i < 3; ++i) {
      const double cell = std::min(kCells - 1, (model.means[g * 3 + i] - low[i]) * scale[i]);
      codes[g] |= Spread(static_cast<uint64_t>(cell)) << i;
    }
  }
  std::vector<uint32_t> order(count);
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(),
                   [&](uint32_t a, uint32_t b) { return codes[a] < codes[b]; });
  return order;
}

}  // namespace retint
