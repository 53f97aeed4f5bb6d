// SPDX-License-Identifier: BSD-3-Clause
// The rules of stereo after and before its matching (common/stereo_match.h), shared by all
// backends: luma, fusion, arbitration and refinement.
#pragma once

#include <cmath>
#include <cstdint>

#include "kernels/common/macros.h"
#include "kernels/common/types.h"

namespace retint {

// StereoOps::Gray of one pixel.
RETINT_HD float Luma(const float* rgb) {
  float unit[3];
  for (int c = 0; c < 3; ++c) unit[c] = rgb[c] < 0 ? 0.0f : rgb[c] > 1 ? 1.0f : rgb[c];
  return 0.299f * unit[0] + 0.587f * unit[1] + 0.114f * unit[2];
}

// StereoOps::Invert of one pixel; `otherwise` may be null.
RETINT_HD float Inverted(const float* values, const float* otherwise, int64_t i, float scale) {
  return values[i] > 0 ? scale / values[i] : otherwise ? otherwise[i] : -1.0f;
}

// StereoOps::Fuse of one pixel.
RETINT_HD float FusedDisparity(const float* const* pairs, int num_pairs, float tolerance,
                               bool nearest, int64_t i) {
  float found[kMaxStereoViews] = {};  // positive ones first, nearest first
  for (int k = 0; k < num_pairs; ++k) {
    float value = pairs[k][i];
    for (int j = 0; j < kMaxStereoViews; ++j) {
      if (!(value > found[j])) continue;
      const float pushed = found[j];
      found[j] = value;
      value = pushed;
    }
  }
  if (!(found[0] > 0)) return -1.0f;
  if (nearest) return found[0];
  float best_sum = 0;
  int best_count = 0;
  for (int first = 0; first < kMaxStereoViews; ++first) {
    float sum = 0;
    int count = 0;
    for (int k = first; k < kMaxStereoViews; ++k) {
      if (!(found[k] > 0) || !(found[first] - found[k] <= tolerance)) continue;
      sum += found[k];
      ++count;
    }
    if (count <= best_count) continue;
    best_sum = sum;
    best_count = count;
  }
  return best_sum / float(best_count);
}

// Arbitration. Stereo is right on surfaces and makes silhouettes too wide. The Gaussians' median
// depth has exact silhouettes and is wrong behind flat colors. If the two disagree, color decides
// first, then continuity.
namespace arbitration {

inline constexpr float kAgree = 1;           // pixels of disparity
inline constexpr int kCostRadius = 2;        // pixels: costs are means over a square window
inline constexpr float kCostCap = 60;        // levels of 255, the three channels summed
inline constexpr float kBetter = 0.8f;       // the better cost must be below this share of the
inline constexpr float kMargin = 1;          // other less this many levels
inline constexpr int kEdgeReach = 16;        // pixels: how far silhouettes are fattened
inline constexpr float kEdgeJump = 3;        // pixels of disparity that make an edge
inline constexpr float kSameSurface = 0.5f;  // pixels of disparity between neighbors
inline constexpr int kMaxGrowth = 40;        // pixels by which confirmed rough depth is continued

enum Verdict : uint8_t { kStereo, kRough, kContinued, kTie, kBoth };

// The mean cost over the two best shifted views: a point hidden in some is visible in others.
struct BestTwo {
  float first = kCostCap, second = kCostCap;
  RETINT_HD void Add(float cost) {
    const float larger = first < cost ? cost : first;
    if (larger < second) second = larger;
    if (cost < first) first = cost;
  }
  RETINT_HD float Mean() const { return 0.5f * (first + second); }
};

// Of the disparities of stereo and the rough depth, from the costs of each.
RETINT_HD Verdict VerdictOf(float stereo, float rough, float stereo_cost, float rough_cost,
                            bool near_edge) {
  if (!(rough > 0)) return kStereo;
  if (!(stereo > 0)) return kTie;
  if (fabsf(stereo - rough) <= kAgree) return kBoth;
  if (rough_cost < kBetter * stereo_cost - kMargin) return kRough;
  return stereo_cost >= kBetter * rough_cost - kMargin && near_edge ? kTie : kStereo;
}

// A tie goes to the rough depth beside a pixel where that was confirmed, without a step between.
RETINT_HD bool Confirms(Verdict verdict) {
  return verdict == kRough || verdict == kBoth || verdict == kContinued;
}
RETINT_HD bool IsSameSurface(float rough, float beside) {
  return fabsf(rough - beside) <= kSameSurface;
}

RETINT_HD bool IsMeasured(Verdict verdict, float stereo) {
  return stereo > 0 && verdict != kContinued;
}
RETINT_HD float Settled(Verdict verdict, float stereo, float rough) {
  if (verdict == kBoth) return 0.5f * (stereo + rough);  // two independent measurements
  return verdict == kRough || verdict == kContinued ? rough : stereo;
}

}  // namespace arbitration

// Refinement: Gauss-Newton on the disparity of every pixel against all shifted views at once, over
// a small square window. The derivative of a warped view is the gradient along the motion, the mean
// of both images' (Baker & Matthews 2004, the symmetric form).
namespace refinement {

inline constexpr int kRadius = 3;        // pixels, of the window of the least squares
inline constexpr int kBlurRadius = 2;    // pixels, of the smoothing before each iteration
inline constexpr int kIterations = 2;    // more follows the renders' own noise
inline constexpr float kMaxStep = 0.5f;  // pixels an iteration
inline constexpr float kMaxMove = 1.0f;  // pixels altogether, from the matcher's value
inline constexpr float kSmooth = 1.5f;   // pixels of disparity across a window: more is an edge
inline constexpr float kGradientFloor = 2e-3f;  // squared gray levels (of 1): less is no texture
inline constexpr float kRobust = 0.05f;         // gray levels (of 1): residuals beyond count little

// Windows that hold a depth edge or a hole are left alone.
RETINT_HD bool IsSmooth(float lowest, float highest) {
  return highest - lowest < kSmooth && lowest > 0;
}

// Geman-McClure: occluded pixels and highlights count little.
RETINT_HD float WeightOf(float residual) {
  const float ratio = residual / kRobust;
  return 1 / ((1 + ratio * ratio) * (1 + ratio * ratio));
}

RETINT_HD float Within(float value, float low, float high) {
  return value < low ? low : high < value ? high : value;
}

// A step of the disparity that started as `start`, from the means over the window of weight *
// gradient * residual and weight * gradient^2. The floor damps steps on surfaces of little texture.
RETINT_HD float Stepped(float disparity, float start, float numerator, float denominator) {
  const float step = Within(numerator / (denominator + kGradientFloor), -kMaxStep, kMaxStep);
  return Within(disparity + step, start - kMaxMove, start + kMaxMove);
}

}  // namespace refinement

}  // namespace retint
