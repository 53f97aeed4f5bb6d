// SPDX-License-Identifier: BSD-3-Clause
// The matcher's steps as the formulas read.
#include <algorithm>
#include <bit>
#include <cstdlib>

#include "kernels/cpu/stereo_match.h"

namespace retint {
namespace {

void CensusRow(const float* const* rows, int width, uint8_t* planes, ptrdiff_t stride) {
  for (int u = 0; u < width; ++u) {
    const float middle = rows[kCensusV][u + kCensusU];
    uint8_t bytes[kCensusBytes] = {};
    bool flat = true;
    int bit = 0;
    for (int j = 0; j <= 2 * kCensusV; ++j) {
      for (int i = 0; i <= 2 * kCensusU; ++i) {
        if (j == kCensusV && i == kCensusU) continue;
        const float other = rows[j][u + i];
        if (other < middle) bytes[bit / 8] |= uint8_t(1 << bit % 8);
        flat = flat && other == middle;
        ++bit;
      }
    }
    if (flat) bytes[kCensusBytes - 1] |= kCensusFlat;
    for (int j = 0; j < kCensusBytes; ++j) planes[j * stride + u] = bytes[j];
  }
}

void CostRow(const StereoCostRow& row, uint8_t* costs) {
  for (int u = row.begin; u < row.end; ++u, costs += row.count) {
    const bool flat = row.own[(kCensusBytes - 1) * row.own_stride + u] & kCensusFlat;
    for (int d = 0; d < row.count; ++d) {
      const int there = u - row.lowest - d;
      int cost = 0;
      for (int j = 0; j < kCensusBytes && there >= 0; ++j) {
        const unsigned own = row.own[j * row.own_stride + u];
        cost += std::popcount(own ^ row.shifted[j * row.shifted_stride + row.width - 1 - there]);
      }
      costs[d] = uint8_t(flat ? 0 : there >= 0 ? cost : kMaxCensusCost);
    }
  }
}

void Step(const StereoStep& step) {
  for (int p = 0; p < step.paths; ++p) {
    const uint8_t* costs = step.costs + p * step.stride;
    uint8_t* state = step.states + p * StereoStateStride(step.count) + kStereoSlack;
    const int least = step.least[p];
    int before = 255, next_least = 255;
    for (int d = 0; d < step.count; ++d) {
      const int own = state[d], near = std::min<int>(before, state[d + 1]) + step.p1;
      const int cost = costs[d] + std::min({own, near, least + step.p2}) - least;
      state[d] = uint8_t(cost);
      next_least = std::min(next_least, cost);
      before = own;
      if (step.sums) {
        uint16_t& sum = step.sums[p * step.stride + d];
        sum = uint16_t(cost + (step.first ? 0 : sum));
      }
    }
    step.least[p] = uint8_t(next_least);
  }
}

void SelectRow(const StereoSelectRow& row) {
  for (int u = 0; u < row.width; ++u) {
    const uint16_t* sums = row.sums + ptrdiff_t(u) * row.count;
    const int index = int(std::min_element(sums, sums + row.count) - sums);
    const int at = row.width - 1 - u + row.lowest;
    int second = 0xffff;
    for (int d = 0; d < row.count; ++d) {
      if (std::abs(d - index) > 1) second = std::min<int>(second, sums[d]);
      if (sums[d] < row.other_sum[at + d]) {
        row.other_sum[at + d] = sums[d];
        row.other_index[at + d] = uint16_t(d);
      }
    }
    row.best[u] = {index, sums[index], index > 0 ? sums[index - 1] : 0,
                   index + 1 < row.count ? sums[index + 1] : 0, second};
  }
}

}  // namespace

const StereoKernels& ScalarStereoKernels() {
  static constexpr StereoKernels kKernels = {CensusRow, CostRow, Step, SelectRow};
  return kKernels;
}

}  // namespace retint
