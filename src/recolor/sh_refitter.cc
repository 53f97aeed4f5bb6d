// SPDX-License-Identifier: BSD-3-Clause
#include "recolor/sh_refitter.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <utility>

#include "base/error.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "recolor/refit_solver.h"

namespace retint {

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

namespace {

// Of colors a million times white: beside them, floats hold no others.
constexpr double kMostLoss = 1e12;

[[noreturn]] void RefuseLoss(double loss, const GaussianModel& model) {
  const auto largest = std::ranges::max_element(
      model.sh, [](float a, float b) { return std::abs(a) < std::abs(b); });
  const auto block = static_cast<std::ptrdiff_t>(model.NumShCoeffs()) * 3;
  char text[160];
  std::snprintf(text, sizeof(text),
                "the loss of the fit is %.3g: Gaussian %lld has the SH coefficient %.3g. Remove "
                "such Gaussians from the splat",
                loss, static_cast<long long>((largest - model.sh.begin()) / block),
                double{*largest});
  throw InputError(text);
}

// Whether a target is more than the edited render. Only its owner may have its photo.
bool AnyPhoto(Backend& backend, const std::vector<RefitTarget>& targets) {
  return ViewReducer(backend, targets.size())
      .Any(std::ranges::any_of(
          targets, [](const RefitTarget& target) { return target.photo || target.edited; }));
}

}  // namespace

struct ShRefitter::Impl {
  Impl(Renderer& renderer, RefitInput input, const RefitOptions& options, Monitor& monitor)
      : model(input.model),
        entry(FindSolver(options.solver)),
        form(entry.make_form(options, input.edit, AnyPhoto(renderer.backend(), input.targets))),
        views(renderer, std::move(input), options, *form, monitor),
        solver(entry.make(views, options, monitor)) {}

  const GaussianModel& model;
  const SolverEntry& entry;
  std::unique_ptr<TargetForm> form;
  RefitViews views;
  std::unique_ptr<RefitSolver> solver;
};

ShRefitter::ShRefitter(Renderer& renderer, const GaussianModel& model,
                       std::vector<RefitTarget> targets, const ColorEdit& edit,
                       std::vector<float> shares, const RefitOptions& options, Monitor& monitor,
                       const GaussianPaint* paint) {
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
  const bool in_range = std::all_of(shares.begin(), shares.end(),
                                    [](float share) { return share >= 0 && share <= 1; });
  CheckOption(in_range, "refit: a share is outside [0, 1]");
  const ColorEdit on_colors = edit.OnColorsOf(model);
  impl_ = std::make_unique<Impl>(
      renderer, RefitInput{model, std::move(targets), on_colors, std::move(shares), paint}, options,
      monitor);
}

ShRefitter::~ShRefitter() = default;

bool ShRefitter::Step(Monitor& monitor) {
  const bool more = impl_->solver->Step(monitor);
  const std::vector<double>& losses = impl_->solver->losses();
  if (!losses.empty() && !(losses.back() <= kMostLoss)) RefuseLoss(losses.back(), impl_->model);
  if (!more) monitor.Step("refit", 1, 1);
  return more;
}

RefitSummary ShRefitter::Run(Monitor& monitor) {
  while (Step(monitor)) {
  }
  return Summary();
}

RefitSummary ShRefitter::Summary() const { return Summary(ActiveSh()); }

RefitSummary ShRefitter::Summary(std::span<const float> active_sh) const {
  RefitSummary summary;
  const RefitSolver& solver = *impl_->solver;
  summary.solver = impl_->entry.name;
  summary.iterations = solver.iterations();
  summary.converged = solver.converged();
  summary.losses = solver.losses();
  summary.reason = solver.reason();
  const RefitViews& views = impl_->views;
  summary.active_gaussians = views.NumActive();
  summary.views = int(views.NumViews());
  summary.views_kept = int(views.NumKeptViews());
  summary.region_bytes = views.KeptBytes();
  summary.region_fraction = views.RegionFraction();
  const std::span<const float> original = views.original();
  const size_t block = size_t(views.num_coeffs()) * 3;
  std::atomic<int64_t> changed = 0;
  ParallelRanges(views.NumActive(), 4096, [&](int64_t begin, int64_t end) {
    int64_t of_piece = 0;
    for (size_t i = size_t(begin) * block; i < size_t(end) * block; i += block) {
      of_piece += std::memcmp(&active_sh[i], &original[i], block * sizeof(float)) != 0;
    }
    changed += of_piece;
  });
  summary.changed_gaussians = changed;
  return summary;
}

const std::vector<double>& ShRefitter::losses() const { return impl_->solver->losses(); }

FloatArray ShRefitter::ActiveSh() const {
  const Buffer<float>& values = impl_->solver->coefficients();
  FloatArray sh;
  ReservePopulated(sh, values.size());
  sh.resize(values.size());
  impl_->views.backend().CopyToHost(sh.data(), values.data(), sh.size() * sizeof(float));
  return sh;
}

FloatArray ShRefitter::Sh() const {
  FloatArray sh = impl_->model.sh;
  const auto values = ActiveSh();
  const size_t block = size_t(impl_->views.num_coeffs()) * 3;
  size_t slot = 0;
  for (const int32_t g : impl_->views.active()) {
    std::copy_n(&values[slot * block], block, &sh[size_t(g) * block]);
    ++slot;
  }
  return sh;
}

std::span<const int32_t> ShRefitter::active() const { return impl_->views.active(); }

}  // namespace retint
