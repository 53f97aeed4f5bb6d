// SPDX-License-Identifier: BSD-3-Clause
// The census matcher of kernels/stereo_ops.h on the CPU. Rows are processed in bands from the
// bottom up. A first sweep down saves the path from above at the top of each band; each band
// computes its own path from there. So the volume of costs is never whole in memory: it needs
// pixels * disparities / kStereoBand bytes, and five for each cost of one band.
#pragma once

#include <cstddef>
#include <cstdint>

#include "kernels/common/stereo_match.h"
#include "kernels/stereo_ops.h"

namespace retint {

inline constexpr int kStereoBand = 32;

// A census transform is 8 bytes, each in a plane of its own. Bit i of byte j tells of the window's
// pixel 8 j + i, row by row and the middle left out; the last bit that all are alike.
inline constexpr int kCensusBytes = 8;
inline constexpr uint8_t kCensusFlat = 0x80;  // in the last byte

// Steps may read and write this many elements beyond the requested ones.
inline constexpr int kStereoSlack = 32;

// The costs of pixels [begin, end) of a row.
struct StereoCostRow {
  const uint8_t* own;      // byte planes [kCensusBytes, own_stride]
  const uint8_t* shifted;  // the same of the shifted view, from the row's end to its start
  ptrdiff_t own_stride, shifted_stride;
  int begin, end, width;
  int lowest, count;
};

// One step of Hirschmueller's (2008) aggregation along several paths at once.
//   L(p, d) = C(p, d) + min(L(q, d), L(q, d +- 1) + P1, min_k L(q, k) + P2) - min_k L(q, k)
// L is at most the largest cost plus P2: a byte. `states` [paths, StereoStateStride(count)] has L
// from kStereoSlack on, 255 on either side; `least` [paths] its minima. Both are updated.
struct StereoStep {
  const uint8_t* costs;  // [paths] rows of count, `stride` apart
  uint8_t* states;
  uint8_t* least;
  uint16_t* sums;  // [paths] rows of count, `stride` apart; null: not summed
  ptrdiff_t stride;
  bool first;  // sums are set, not added to
  int paths, count;
  uint8_t p1, p2;
};
constexpr ptrdiff_t StereoStateStride(int count) { return count + 2 * kStereoSlack; }

// The least sum of a pixel (if several are equal, the first), and the sums around it.
struct StereoBest {
  int index, least;
  int below, above;  // the neighbors' sums; 0 if there is no neighbor
  int second;        // the least of the others
};

// The best of each pixel of a row, and of each pixel of the shifted view by the same sums.
struct StereoSelectRow {
  const uint16_t* sums;  // [width, count]
  int width, lowest, count;
  StereoBest* best;  // [width]
  // The shifted view's, from the row's end to its start [width + lowest + count]: least sum, or
  // 0xffff, and its index.
  uint16_t* other_sum;
  uint16_t* other_index;
};

struct StereoKernels {
  // The census transform of a row: rows[2 kCensusV + 1] start kCensusU pixels to the left.
  void (*census_row)(const float* const* rows, int width, uint8_t* planes, ptrdiff_t stride);
  void (*cost_row)(const StereoCostRow& row, uint8_t* costs);  // [end - begin, count]
  void (*step)(const StereoStep& step);
  void (*select_row)(const StereoSelectRow& row);
};

const StereoKernels& ScalarStereoKernels();
const StereoKernels& SimdStereoKernels();

void MatchStereoOnCpu(const StereoKernels& kernels, const StereoMatchParams& params);

}  // namespace retint
