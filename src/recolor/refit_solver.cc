// SPDX-License-Identifier: BSD-3-Clause
#include "recolor/refit_solver.h"

#include <cmath>

#include "base/error.h"
#include "recolor/adam_solver.h"
#include "recolor/mm_solver.h"

namespace retint {
namespace {

// In the order of Solver.
constexpr SolverEntry kSolvers[] = {
    {Solver::kMm, "mm", RefitProblem::Targets::kRegions,
     [](RefitProblem& problem, const RefitOptions& options,
        Monitor& monitor) -> std::unique_ptr<RefitSolver> {
       return std::make_unique<MmSolver>(problem, options.mm, monitor);
     }},
    {Solver::kAdam, "adam", RefitProblem::Targets::kBoxes,
     [](RefitProblem& problem, const RefitOptions& options,
        Monitor&) -> std::unique_ptr<RefitSolver> {
       return std::make_unique<AdamSolver>(problem, options.adam);
     }},
};

}  // namespace

const SolverEntry& FindSolver(Solver solver) { return kSolvers[size_t(solver)]; }

bool RefitSolver::Step(Monitor& monitor) {
  if (finished_) return false;
  if (problem_.NumActive() == 0) return Finish(true, "the masks touch no Gaussian");
  return Iterate(monitor);
}

bool RefitSolver::Finish(bool converged, const char* reason) {
  finished_ = true;
  converged_ = converged;
  reason_ = reason;
  return false;
}

void RefitOptions::Check() const {
  CheckOption(solver == Solver::kMm || solver == Solver::kAdam, "there is no such solver");
  CheckOption(active_threshold >= 0 && active_threshold < 1, "active threshold must be in [0, 1)");
  mm.Check();
  adam.Check();
}

}  // namespace retint
