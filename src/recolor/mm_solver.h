// SPDX-License-Identifier: BSD-3-Clause
// The squared loss of the refit, minimised by block-Jacobi majorisation. Internal to recolor.
//
//   Phi(s) = sum_v |D_v - W_v (f_v(s) - f_v(s_original))|^2
//            + sum_g V_g sum_k ridge_k |s_gk - start_gk|^2
// with D_v the change that the target asks for, f_v = max(0, 0.5 + Y_v s), V_g = sum_v vis_gv.
// A_g = sum_v vis_gv y y^T + ridge V_g bounds the curvature, because the weights of a pixel sum to
// at most 1: s + A^-1 (-grad / 2) never raises Phi where no colour is clamped.
#pragma once

#include <string>
#include <vector>

#include "recolor/refit_problem.h"

namespace retint {

class MmSolver {
 public:
  MmSolver(RefitProblem& problem, const RefitOptions& options, Monitor& monitor);

  // One sweep over the views; false when converged or out of sweeps.
  bool Step(Monitor& monitor);
  const Buffer<float>& coefficients() const { return current_; }
  int iterations() const { return iterations_; }
  bool converged() const { return converged_; }
  const std::vector<double>& losses() const { return losses_; }  // Phi / values of the regions
  const std::string& reason() const { return reason_; }

 private:
  void BuildBlocks(Monitor& monitor);
  double Evaluate(const Buffer<float>& point, bool with_gradient, Monitor& monitor);
  void ApplyNormalMatrix(Monitor& monitor);
  void Precondition();  // solution_ = A^-1 gradient_
  void Combine(float a, const Buffer<float>& x, float b, const Buffer<float>& y,
               Buffer<float>& out);
  double Dot(const Buffer<float>& x, const Buffer<float>& y);
  void AddRidgeTerm(const Buffer<float>& x, float scale, Buffer<float>& out);
  void Progress(Monitor& monitor, size_t view) const;

  bool SimpleStep(Monitor& monitor);
  bool Linearize(Monitor& monitor);
  bool ConjugateStep(Monitor& monitor);
  bool EndSegment(bool settled, Monitor& monitor);
  bool Finish(bool converged, const char* reason);

  RefitProblem& problem_;
  RefitOptions options_;
  int limit_;
  float ridge_[kMaxShCoeffs] = {};
  Buffer<float> factors_, weights_;            // [active, K (K + 1) / 2], [active]
  Buffer<float> start_, current_, previous_;   // [active, K, 3]
  Buffer<float> point_, gradient_, solution_;  // where the loss was taken, -grad / 2, A^-1 of it
  Buffer<float> direction_, product_;          // conjugate gradients: p, H p
  Buffer<double> loss_;                        // [1]
  double momentum_ = 1;                        // Nesterov
  double base_loss_ = 0, model_loss_ = 0;      // Phi at previous_, and at current_ if linear
  double rho_ = 0;                             // gradient . solution
  bool linearized_ = false;
  int iterations_ = 0;
  bool converged_ = false, finished_ = false;
  std::vector<double> losses_;
  std::string reason_;
};

}  // namespace retint
