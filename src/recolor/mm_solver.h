// SPDX-License-Identifier: BSD-3-Clause
// The squared loss of the refit, minimized by block-Jacobi majorization. Internal to recolor.
// After a few sweeps, pixels that are to stay as they are cost StayLoss (kernels/common/loss.h)
// instead of their square.
//
//   Phi(s) = sum_v |D_v - W_v (f_v(s) - f_v(s_original))|^2, each pixel by its weight w in (0, 1],
//            + sum_g V_g sum_k ridge_k |s_gk - start_gk|^2
// with D_v the change required by the target, f_v = max(0, 0.5 + Y_v s), V_g = sum_v vis_gv,
// vis = W^T w.
// A_g = sum_v vis_gv y y^T + ridge V_g bounds the curvature, because the weights of a pixel sum to
// at most 1. So s + A^-1 (-grad / 2) never raises Phi if no color is clamped.
#pragma once

#include <vector>

#include "recolor/refit_solver.h"

namespace retint {

class MmSolver : public RefitSolver {
 public:
  MmSolver(RefitViews& views, const MmOptions& options, Monitor& monitor);

  // losses() is Phi / values of the masks, one a sweep. Once StayLoss begins to count, they are its
  // alone: the start's, and one a sweep from there.
  const Buffer<float>& coefficients() const override { return current_; }

 private:
  bool Iterate(Monitor& monitor) override;  // one sweep over the views
  void BuildBlocks(Monitor& monitor);
  double Evaluate(const Buffer<float>& point, bool with_gradient, Monitor& monitor);
  void Precondition(const Buffer<float>& rhs);  // solution_ = A^-1 rhs
  void Combine(float a, const Buffer<float>& x, float b, const Buffer<float>& y,
               Buffer<float>& out);
  double Dot(const Buffer<float>& x, const Buffer<float>& y);
  // Phi's ridge at `point`; half its gradient is taken off `descent`, where that is not null.
  double RidgeTerm(const Buffer<float>& point, float* descent);
  void Progress(Monitor& monitor, size_t view) const;

  // Whether the next sweep is the first with StayLoss in pixels that stay. That is so once the
  // squares have settled. Then also makes blocks for the curvature at current_.
  bool StartsStaying(bool converged, Monitor& monitor);
  double GoToMinimum(double loss);
  bool ShortenStep(double loss);
  void RememberPair();
  void NextDirection();
  double SmallGain() const;
  bool FinishChecked(bool converged, const char* reason, Monitor& monitor);

  MmOptions options_;
  int limit_;
  float ridge_[kMaxShCoeffs] = {};
  static constexpr size_t kMaxPairs = 6;

  // Step s and change y of the gradient over it, y . s = 1 / rho (L-BFGS).
  struct Pair {
    Buffer<float> s, y;
    double rho = 0;
  };

  Buffer<float> factors_, weights_;           // [active, K (K + 1) / 2], [active]
  Buffer<float> start_, current_, previous_;  // [active, K, 3]
  Buffer<float> gradient_, solution_;         // -grad / 2 of the loss, A^-1 of it
  Buffer<float> accepted_gradient_, direction_;
  std::vector<Pair> pairs_;   // oldest first
  Buffer<double> loss_;       // [1]
  double first_squares_ = 0;  // the first loss, of which tolerance is a share
  double accepted_loss_ = 0, slope_ = 0, length_ = 1, scale_ = 1;
  bool started_ = false;  // a point was accepted with the loss as it is now
  StayLoss stay_;
};

}  // namespace retint
