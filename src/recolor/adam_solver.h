// SPDX-License-Identifier: BSD-3-Clause
// The paper's solver: Adam on (1 - lambda) L1 + lambda D-SSIM of one random training view a step
// (ReCoGS, STAG 2025; Kingma & Ba 2015). Internal to recolor.
#pragma once

#include <cstdint>
#include <random>
#include <vector>

#include "recolor/refit_solver.h"

namespace retint {

class AdamSolver : public RefitSolver {
 public:
  AdamSolver(RefitViews& views, const AdamOptions& options);

  // losses() is the mean of every 50 steps.
  const Buffer<float>& coefficients() const override { return values_; }

  // One view at the current coefficients: leaves the gradient [active, K, 3], and adds the loss to
  // RecentLoss(), which waits for the device. The view's owner does, and the other processes
  // learn of it.
  void Evaluate(size_t view);
  double RecentLoss();
  const Buffer<float>& gradient() const { return gradient_; }

 private:
  bool Iterate(Monitor& monitor) override;  // one view
  size_t NextView();
  void EvaluateOwn(size_t view);
  void Share(size_t view);

  AdamOptions options_;
  Buffer<float> values_, gradient_, m_, v_;  // [active, K, 3]
  std::mt19937_64 random_;
  std::vector<size_t> deck_;    // views left in this round
  Buffer<double> recent_loss_;  // [1]
  double shared_loss_ = 0;      // the same of several processes
};

}  // namespace retint
