// SPDX-License-Identifier: BSD-3-Clause
// The paper's solver: Adam on (1 - lambda) L1 + lambda D-SSIM of one random training view a step
// (ReCoGS, STAG 2025; Kingma & Ba 2015). Internal to recolor.
#pragma once

#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "recolor/refit_problem.h"

namespace retint {

class AdamSolver {
 public:
  AdamSolver(RefitProblem& problem, const RefitOptions& options);

  // One view; false when out of steps.
  bool Step(Monitor& monitor);
  const Buffer<float>& coefficients() const { return values_; }
  int iterations() const { return iterations_; }
  bool converged() const { return converged_; }
  const std::vector<double>& losses() const { return losses_; }  // mean of every 50 steps
  const std::string& reason() const { return reason_; }

  // One view at the current coefficients: leaves the gradient [active, K, 3], and adds the loss to
  // RecentLoss(), which waits for the device.
  void Evaluate(size_t view);
  double RecentLoss();
  const Buffer<float>& gradient() const { return gradient_; }

 private:
  size_t NextView();

  RefitProblem& problem_;
  RefitOptions options_;
  int limit_;
  Buffer<float> values_, gradient_, m_, v_;  // [active, K, 3]
  std::mt19937_64 random_;
  std::vector<size_t> deck_;  // views left in this round
  int iterations_ = 0;
  bool converged_ = false;
  Buffer<double> recent_loss_;  // [1]
  std::vector<double> losses_;
  std::string reason_;
};

}  // namespace retint
