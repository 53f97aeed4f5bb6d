// SPDX-License-Identifier: BSD-3-Clause
// Stereo on rendered pairs (Stereo-HV, src/depth) in backend memory. Each operation is one
// stage; nothing travels to the host but a few quantiles.
//
// The reference view's pixels are the grid [H, W]. Every other image lies on that grid's plane with
// its first pixel at (x, y), which may be negative. A reference pixel p with disparity s > 0 is at
// p + s (dx, dy) in a shifted view, where one of dx, dy is +-1 and the other 0. So s = f beta / z,
// whichever way the view was shifted. Unknown disparities are negative.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kernels/common/types.h"

namespace retint {

inline constexpr int kMaxQuantiles = 8;
inline constexpr int kStereoCountStep = 32;  // disparities searched: a multiple of this ...
inline constexpr int kMaxStereoCount = 256;  // ... and at most this

// Semi-global matching (Hirschmueller 2008) of the reference with one shifted view. The cost of a
// disparity is the number of differing bits of the census transforms over 9 x 7 pixels (9 along the
// baseline); one more bit marks flat windows. Costs are summed up along four paths: left, right,
// above and below. In flat windows every disparity costs the same.
struct StereoMatchParams {
  StereoView reference, shifted;  // gray is read; both images hold the whole grid, and the
                                  // reference also everything that `shifted` shows
  int32_t width, height;          // W, H
  int32_t lowest, count;          // disparities searched: lowest ... lowest + count - 1
  float tolerance;                // pixels, between matching this way and the other
  float* disparity;               // [H, W] sub-pixel
  // Penalties, in units of one differing census bit, of a change of one disparity between
  // neighbors and of a larger one.
  int32_t p1 = 6, p2 = 80;
  int32_t uniqueness_percent = 10;  // margin by which the best cost must beat the others
};

// Per pixel: the mean of the largest set of disparities that agrees within `tolerance`, of two as
// large the nearer; with `nearest` simply the nearest (largest) one.
struct StereoFuseParams {
  const float* pairs[kMaxStereoViews];  // [H, W] each
  int32_t num_pairs;
  int64_t pixels;
  float tolerance;  // pixels
  bool nearest;
  float* disparity;  // [H, W]
};

// Decides between `disparity` and the Gaussians' own, `rough`, if they disagree. The colors of the
// shifted views decide first. Near depth edges, if flat color favors neither, `rough` is taken if
// it continues a confirmed surface. If the two agree, the result is their mean.
struct StereoArbitrateParams {
  StereoView reference;  // rgb is read
  StereoView shifted[kMaxStereoViews];
  int32_t num_shifted;
  int32_t width, height;
  const float* rough;  // [H, W]
  float* disparity;    // [H, W], in and out
  uint8_t* measured;   // [H, W] 255 where the result was measured in the pairs, else 0
};

// Removes the matcher's sub-pixel bias: Gauss-Newton on the disparity of every pixel against all
// shifted views at once, over a small window, where the disparity is smooth.
struct StereoRefineParams {
  StereoView reference;  // gray is read
  StereoView shifted[kMaxStereoViews];
  int32_t num_shifted;
  int32_t width, height;
  float* disparity;  // [H, W], in and out
};

class StereoOps {
 public:
  virtual ~StereoOps() = default;

  // The values at fractions of the sorted positive ones: index fraction * (n - 1), rounded down.
  // Returned on the host; empty when none is positive. At most kMaxQuantiles fractions in [0, 1].
  std::vector<float> PositiveQuantiles(const float* values, int64_t count,
                                       std::span<const double> fractions);
  // Luma 0.299 R + 0.587 G + 0.114 B of the channels clamped to [0, 1]: [pixels, 3] -> [pixels].
  void Gray(const float* rgb, int64_t pixels, float* gray);
  // out = scale / value where value > 0, else `otherwise` (null: -1) [count]; out may be either.
  void Invert(const float* values, const float* otherwise, int64_t count, float scale, float* out);
  void Match(const StereoMatchParams& params);
  void Fuse(const StereoFuseParams& params);
  void Arbitrate(const StereoArbitrateParams& params);
  void Refine(const StereoRefineParams& params);

 protected:
  virtual std::vector<float> DoPositiveQuantiles(const float* values, int64_t count,
                                                 std::span<const double> fractions) = 0;
  virtual void DoGray(const float* rgb, int64_t pixels, float* gray) = 0;
  virtual void DoInvert(const float* values, const float* otherwise, int64_t count, float scale,
                        float* out) = 0;
  virtual void DoMatch(const StereoMatchParams& params) = 0;
  virtual void DoFuse(const StereoFuseParams& params) = 0;
  virtual void DoArbitrate(const StereoArbitrateParams& params) = 0;
  virtual void DoRefine(const StereoRefineParams& params) = 0;
};

}  // namespace retint
