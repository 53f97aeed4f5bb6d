// SPDX-License-Identifier: BSD-3-Clause
#include "recolor/refit_solver.h"

#include <utility>

#include "recolor/adam_boxes.h"
#include "recolor/adam_solver.h"
#include "recolor/mm_solver.h"
#include "recolor/mm_targets.h"

namespace retint {
namespace {

std::unique_ptr<TargetForm> MakeMmTargets(const RefitOptions& options, const ColorEdit& edit,
                                          bool photos) {
  return std::make_unique<MmTargets>(options.mm, CompiledEdit(edit), photos);
}
std::unique_ptr<RefitSolver> MakeMm(RefitViews& views, const RefitOptions& options,
                                    Monitor& monitor) {
  return std::make_unique<MmSolver>(views, options.mm, monitor);
}

std::unique_ptr<TargetForm> MakeAdamBoxes(const RefitOptions&, const ColorEdit&, bool) {
  return std::make_unique<AdamBoxes>();
}
std::unique_ptr<RefitSolver> MakeAdam(RefitViews& views, const RefitOptions& options, Monitor&) {
  return std::make_unique<AdamSolver>(views, options.adam);
}

// In the order of Solver.
constexpr SolverEntry kSolvers[] = {
    {Solver::kMm, "mm", MakeMmTargets, MakeMm},
    {Solver::kAdam, "adam", MakeAdamBoxes, MakeAdam},
};

}  // namespace

const SolverEntry& FindSolver(Solver solver) { return kSolvers[size_t(solver)]; }

bool RefitSolver::Step(Monitor& monitor) {
  if (finished_) return false;
  if (views_.NumActive() == 0) return Finish(true, "the masks touch no Gaussian");
  return Iterate(monitor);
}

bool RefitSolver::Finish(bool converged, const char* reason) {
  finished_ = true;
  converged_ = converged;
  reason_ = reason;
  return false;
}

void RefitOptions::Describe(OptionList& list) {
  std::vector<std::string> names;
  for (const SolverEntry& entry : kSolvers) names.emplace_back(entry.name);
  list.push_back(
      {.name = "solver",
       .member = ChoiceOf(solver, std::move(names)),
       .help = "how the fit is solved: mm (block sweeps) or adam (the paper's gradient steps)",
       .tier = OptionTier::kExpert});
  DescribePart(mm, FindSolver(Solver::kMm).name, list);
  DescribePart(adam, FindSolver(Solver::kAdam).name, list);
  list.push_back({.name = "active_threshold",
                  .member = &active_threshold,
                  .range = OptionRange::UpTo(0, 1),
                  .help = "share inside the masks above which a Gaussian may change",
                  .title = "Recolor from a share of",
                  .tier = OptionTier::kExpert});
  list.push_back({.name = "region_cache_mb",
                  .member = &region_cache_mb,
                  .range = OptionRange::Closed(0, 0x1p22),
                  .help = "memory for the fit's weights and targets; what does not fit is computed "
                          "again at each visit, with unrounded weights",
                  .title = "Memory for the fit, MiB",
                  .unit = "MiB",
                  .tier = OptionTier::kExpert});
}

void RefitOptions::Check() const { CheckRanges(*this); }

}  // namespace retint
