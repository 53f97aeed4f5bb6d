// SPDX-License-Identifier: BSD-3-Clause
// What the refit asks of a solver, and the list of those that there are. Internal to recolor.
//
// To add a solver: a value of Solver and a struct of options (refit_options.h), a class derived
// from RefitSolver in files of its own, and an entry of the list in refit_solver.cc.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "recolor/refit_problem.h"

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
  explicit RefitSolver(RefitProblem& problem) : problem_(problem) {}
  // There is an active Gaussian, and Finish() was not called yet.
  virtual bool Iterate(Monitor& monitor) = 0;
  bool Finish(bool converged, const char* reason);  // always false

  RefitProblem& problem_;
  int iterations_ = 0;
  std::vector<double> losses_;

 private:
  bool converged_ = false, finished_ = false;
  std::string reason_;
};

struct SolverEntry {
  Solver solver;
  const char* name;  // in options, sessions and reports
  RefitProblem::Targets targets;
  std::unique_ptr<RefitSolver> (*make)(RefitProblem& problem, const RefitOptions& options,
                                       Monitor& monitor);
};

const SolverEntry& FindSolver(Solver solver);

}  // namespace retint
