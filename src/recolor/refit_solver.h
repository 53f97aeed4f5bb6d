// SPDX-License-Identifier: BSD-3-Clause
// The interface of a solver, and the list of all solvers. Internal to recolor.
//
// To add a solver, write a value of Solver, a struct of options (refit_options.h), and an entry of
// the list in refit_solver.cc. In files of their own, write a class derived from RefitSolver and a
// TargetForm, or use the form of another solver.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "recolor/refit_views.h"

namespace retint {

class RefitSolver {
 public:
  virtual ~RefitSolver() = default;

  // One sweep or step. False when nothing is left to do; more calls then change nothing. Cancelled
  // leaves the coefficients of the last whole step.
  bool Step(Monitor& monitor);

  virtual const Buffer<float>& coefficients() const = 0;  // [active, K, 3]
  int iterations() const { return iterations_; }
  bool converged() const { return converged_; }
  const std::vector<double>& losses() const { return losses_; }
  const std::string& reason() const { return reason_; }  // why it ended; empty before

 protected:
  explicit RefitSolver(RefitViews& views) : views_(views) {}
  // There is an active Gaussian, and Finish() was not called yet.
  virtual bool Iterate(Monitor& monitor) = 0;
  bool Finish(bool converged, const char* reason);  // always false

  RefitViews& views_;
  int iterations_ = 0;
  std::vector<double> losses_;

 private:
  bool converged_ = false, finished_ = false;
  std::string reason_;
};

struct SolverEntry {
  Solver solver;
  const char* name;  // in options, sessions and reports
  // `photos`: a target is more than the edited render.
  std::unique_ptr<TargetForm> (*make_form)(const RefitOptions& options, const ColorEdit& edit,
                                           bool photos);
  std::unique_ptr<RefitSolver> (*make)(RefitViews& views, const RefitOptions& options,
                                       Monitor& monitor);
};

const SolverEntry& FindSolver(Solver solver);

}  // namespace retint
