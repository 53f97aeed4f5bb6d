// SPDX-License-Identifier: BSD-3-Clause
// Options of the refit: those of every solver, and a struct of each solver's own.
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/option.h"

namespace retint {

enum class Solver { kMm, kAdam };

// Block sweeps on the squared error, from the closed form (mm_solver.h).
struct MmOptions {
  // Sweeps at most. 0: as many as it takes to converge, but no more than kMostSweeps.
  static constexpr int kMostSweeps = 1000;
  int iterations = 16;
  double ridge_dc = 1e-2;       // lambda_l of the DC term, relative to the sum of visibilities
  double ridge_rest = 1e-3;     // of the higher bands, pulling towards the closed-form start
  double outside_weight = 0.4;  // of a pixel's error at mask 0; it is 1 at mask 255
  double outside_slope = 12;    // of StayLoss (kernels/common/loss.h), in steps of 1/255
  double min_weight = 1e-3;     // blending weights below are left out of the regions
  double tolerance = 5e-4;      // stop when a sweep gains less than this share of the first loss
  void Describe(OptionList& list);
  void Check() const;
};

// The paper's gradient steps on L1 and D-SSIM (adam_solver.h).
struct AdamOptions {
  // Steps. 0: until the caller stops calling, as the paper does; then Run() does not return.
  int iterations = 3000;
  bool closed_form_start = true;  // false: from the original coefficients, as the paper does
  double learning_rate = 2.5e-4;
  double lambda_dssim = 0.2;  // weight of D-SSIM in the loss
  uint64_t seed = 0;          // of the order of the views
  void Describe(OptionList& list);
  void Check() const;
};

struct RefitOptions {
  Solver solver = Solver::kMm;
  MmOptions mm;
  AdamOptions adam;
  double active_threshold = 5e-2;  // m_g above which a Gaussian is active
  double region_cache_mb = 1000;   // MiB of weights and targets, all views together
  size_t RegionCacheBytes() const { return static_cast<size_t>(region_cache_mb * 0x1p20); }
  void SetRegionCacheBytes(size_t bytes) { region_cache_mb = static_cast<double>(bytes) / 0x1p20; }
  void Describe(OptionList& list);
  void Check() const;
};

}  // namespace retint
