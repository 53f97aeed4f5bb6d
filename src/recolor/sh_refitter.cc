// SPDX-License-Identifier: BSD-3-Clause
#include "recolor/sh_refitter.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <optional>
#include <utility>

#include "base/error.h"
#include "recolor/adam_solver.h"
#include "recolor/mm_solver.h"
#include "recolor/refit_problem.h"

namespace retint {

void RefitOptions::Check() const {
  const auto finite_at_least = [](double value, double least) {
    return std::isfinite(value) && value >= least;
  };
  CheckOption(iterations >= 0, "iterations must not be negative");
  CheckOption(std::isfinite(learning_rate) && learning_rate > 0, "learning rate must be above 0");
  CheckOption(lambda_dssim >= 0 && lambda_dssim <= 1, "D-SSIM weight must be in [0, 1]");
  CheckOption(finite_at_least(ridge_dc, 0), "ridge of the DC term must not be negative");
  CheckOption(finite_at_least(ridge_rest, 0), "ridge of the higher bands must not be negative");
  CheckOption(outside_weight > 0 && outside_weight <= 1, "outside weight must be in (0, 1]");
  CheckOption(active_threshold >= 0 && active_threshold < 1, "active threshold must be in [0, 1)");
  CheckOption(min_weight >= 0 && min_weight < 0.1, "least weight must be in [0, 0.1)");
  CheckOption(finite_at_least(tolerance, 0), "tolerance must not be negative");
}

std::string RefitSummary::BriefReport() const {
  char text[256];
  std::snprintf(text, sizeof(text), "%s: %d iterations, %lld active and %lld changed Gaussians, %s",
                solver.c_str(), iterations, static_cast<long long>(active_gaussians),
                static_cast<long long>(changed_gaussians), converged ? "converged" : "stopped");
  std::string report = text;
  if (!losses.empty()) {
    std::snprintf(text, sizeof(text), ", loss %.4g to %.4g", losses.front(), losses.back());
    report += text;
  }
  return reason.empty() ? report : report + " (" + reason + ")";
}

struct ShRefitter::Impl {
  Impl(Renderer& renderer, const GaussianModel& model_in, std::vector<RefitTarget> targets,
       const ColorEdit& edit, std::vector<float> shares, const RefitOptions& options_in,
       Monitor& monitor)
      : model(model_in),
        options(options_in),
        problem(renderer, model_in, std::move(targets), edit, std::move(shares), options_in,
                options_in.solver == Solver::kMm ? RefitProblem::Targets::kRegions
                                                 : RefitProblem::Targets::kBoxes,
                monitor) {
    if (options.solver == Solver::kMm) {
      mm.emplace(problem, options, monitor);
    } else {
      adam.emplace(problem, options);
    }
  }

  std::vector<float> Coefficients() {
    const Buffer<float>& values = mm ? mm->coefficients() : adam->coefficients();
    return problem.backend().Download(values.data(), values.size());
  }

  template <typename Function>
  auto Ask(Function function) const {
    return mm ? function(*mm) : function(*adam);
  }

  const GaussianModel& model;
  RefitOptions options;
  RefitProblem problem;
  std::optional<MmSolver> mm;
  std::optional<AdamSolver> adam;
};

ShRefitter::ShRefitter(Renderer& renderer, const GaussianModel& model,
                       std::vector<RefitTarget> targets, const ColorEdit& edit,
                       std::vector<float> shares, const RefitOptions& options, Monitor& monitor) {
  options.Check();
  edit.Check();
  CheckOption(!targets.empty(), "refit: there is no view to fit");
  for (const auto& target : targets) CheckTarget(target);
  CheckOption(int64_t(model.NumGaussians()) == renderer.model().count() &&
                  model.sh_degree == renderer.model().sh_degree(),
              "refit: the renderer holds another model");
  if (shares.empty()) shares = MaskShares(renderer, targets, monitor);
  CheckOption(shares.size() == model.NumGaussians(),
              "refit: one share a Gaussian is needed, got " + std::to_string(shares.size()));
  for (const float share : shares) {
    CheckOption(share >= 0 && share <= 1, "refit: a share is outside [0, 1]");
  }
  impl_ = std::make_unique<Impl>(renderer, model, std::move(targets), edit, std::move(shares),
                                 options, monitor);
}

ShRefitter::~ShRefitter() = default;

bool ShRefitter::Step(Monitor& monitor) {
  return impl_->mm ? impl_->mm->Step(monitor) : impl_->adam->Step(monitor);
}

RefitSummary ShRefitter::Run(Monitor& monitor) {
  while (Step(monitor)) {
  }
  monitor.Step("refit", 1, 1);
  return Summary();
}

RefitSummary ShRefitter::Summary() const {
  RefitSummary summary;
  summary.solver = impl_->mm ? "mm" : "adam";
  impl_->Ask([&](const auto& solver) {
    summary.iterations = solver.iterations();
    summary.converged = solver.converged();
    summary.losses = solver.losses();
    summary.reason = solver.reason();
  });
  const RefitProblem& problem = impl_->problem;
  summary.active_gaussians = problem.NumActive();
  summary.views = int(problem.NumViews());
  summary.views_kept = int(problem.NumKeptViews());
  summary.region_bytes = problem.KeptBytes();
  summary.region_fraction = problem.RegionFraction();
  const auto values = impl_->Coefficients();
  const auto& original = problem.original();
  const size_t block = size_t(problem.num_coeffs()) * 3;
  for (size_t first = 0; first < values.size(); first += block) {
    summary.changed_gaussians +=
        std::memcmp(&values[first], &original[first], block * sizeof(float)) != 0;
  }
  return summary;
}

std::vector<float> ShRefitter::Sh() const {
  std::vector<float> sh = impl_->model.sh;
  const auto values = impl_->Coefficients();
  const size_t block = size_t(impl_->problem.num_coeffs()) * 3;
  size_t slot = 0;
  for (const int32_t g : impl_->problem.active()) {
    std::copy_n(&values[slot * block], block, &sh[size_t(g) * block]);
    ++slot;
  }
  return sh;
}

std::span<const int32_t> ShRefitter::active() const { return impl_->problem.active(); }

}  // namespace retint
