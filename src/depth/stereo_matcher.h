// SPDX-License-Identifier: BSD-3-Clause
// Dense matching of a rectified pair, behind one interface so that matchers can be exchanged.
#pragma once

#include <limits>
#include <memory>
#include <string>

#include "base/monitor.h"
#include "base/option.h"
#include "scene/image.h"

namespace retint {

// Disparities searched: `lowest` ... `lowest + count - 1`, whole pixels.
struct DisparityRange {
  int lowest = 0;
  int count = 64;  // a multiple of 16
};

struct StereoMatch {
  // s = x_left - x_right >= 0 of each left pixel, sub-pixel; negative if it has no match.
  ScalarImage disparity;
};

class StereoMatcher {
 public:
  virtual ~StereoMatcher() = default;
  // Disparity of `left` against `right`, two images of one size whose rows correspond. A pixel can
  // be matched only if x >= lowest + count - 1: pad on the left by that much to match them all.
  // Called from several threads at once, a network from one. Long operations end when the monitor
  // is cancelled.
  virtual StereoMatch Match(const Image8& left, const Image8& right, const DisparityRange& range,
                            const Monitor& monitor) const = 0;
  // Identifies a user's own matcher and its version, because results depend on it.
  virtual std::string Identity() const { return {}; }
  // The largest disparity that it finds.
  virtual int MostDisparity() const { return std::numeric_limits<int>::max(); }
};

struct SgbmOptions {
  int block_size = 5;            // pixels, odd
  int smoothness = 8;            // P1 = smoothness * block_size^2, a change of one disparity
  int jump = 32;                 // P2 = jump * block_size^2, a larger change
  int uniqueness_percent = 5;    // margin by which the best cost must beat the second best
  int speckle_pixels = 60;       // smaller isolated patches are dropped; 0 keeps all
  int left_right_tolerance = 1;  // pixels, of OpenCV's own coarse check; -1 switches it off
  bool all_paths = false;        // eight aggregation paths (slower, more memory) instead of three
  void Describe(OptionList& list);
  void Check() const;
};

// OpenCV's StereoSGBM: semi-global matching (Hirschmueller 2008) with the Birchfield-Tomasi cost.
std::unique_ptr<StereoMatcher> MakeSgbmMatcher(const SgbmOptions& options = {});

}  // namespace retint
