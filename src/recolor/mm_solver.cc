// SPDX-License-Identifier: BSD-3-Clause
#include "recolor/mm_solver.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "recolor/mm_targets.h"
#include "recolor/view_sum.h"

namespace retint {
namespace {

constexpr const char* kSmallGain = "a sweep lowered the loss by less than the tolerance";
constexpr int kSquaredSweeps = 5;  // after which changes outside also count by their size
constexpr double kArmijo = 1e-4;   // of the promised decrease that a step must bring
constexpr double kShortestStep = 1e-3;
constexpr double kLongestStep = 4;  // beyond the trial, in steps to it
constexpr double kClamped = 0.05;   // of the promised decrease, by which a parabola may be missed

}  // namespace

void MmOptions::Describe(OptionList& list) {
  list.push_back({.name = "iterations",
                  .member = &iterations,
                  .range = OptionRange::AtLeast(0),
                  .help = "sweeps at most; 0: until it has converged, 1000 at most",
                  .tier = OptionTier::kExpert});
  list.push_back({.name = "outside_weight",
                  .member = &outside_weight,
                  .range = OptionRange::AboveTo(0, 8),
                  .help = "weight of the error of pixels outside the mask; those inside have 1",
                  .tier = OptionTier::kOccasional});
  list.push_back({.name = "outside_slope",
                  .member = &outside_slope,
                  .range = OptionRange::Closed(0, 255),
                  .help = "how much the size of a change counts beside its square in pixels that "
                          "are to stay as they are, in steps of 1/255; 0: the square alone",
                  .tier = OptionTier::kExpert});
  list.push_back({.name = "tolerance",
                  .member = &tolerance,
                  .range = OptionRange::AtLeast(0),
                  .help = "stop when a sweep lowers the loss by less than this share of the first",
                  .tier = OptionTier::kExpert});
  list.push_back({.name = "ridge_dc",
                  .member = &ridge_dc,
                  .range = OptionRange::AtLeast(0),
                  .help = "pull of the constant term towards the closed form",
                  .title = "Keep the first colors",
                  .tier = OptionTier::kExpert});
  list.push_back({.name = "ridge_rest",
                  .member = &ridge_rest,
                  .range = OptionRange::AtLeast(0),
                  .help = "pull of the higher bands towards the closed form",
                  .title = "Keep the first shading",
                  .tier = OptionTier::kExpert});
  list.push_back({.name = "min_weight",
                  .member = &min_weight,
                  .range = OptionRange::UpTo(0, 0.1),
                  .help = "blending weights below are left out"});
}

void MmOptions::Check() const { CheckRanges(*this); }

MmSolver::MmSolver(RefitViews& views, const MmOptions& options, Monitor& monitor)
    : RefitSolver(views),
      options_(options),
      limit_(options.iterations > 0 ? options.iterations : MmOptions::kMostSweeps) {
  Backend& backend = views_.backend();
  for (int k = 0; k < views_.num_coeffs(); ++k) {
    ridge_[k] = float(k == 0 ? options.ridge_dc : options.ridge_rest);
  }
  const size_t values = views_.NumValues();
  start_ = backend.Upload(views_.start());
  for (auto* buffer :
       {&current_, &previous_, &gradient_, &solution_, &accepted_gradient_, &direction_}) {
    *buffer = backend.Allocate<float>(values);
  }
  loss_ = backend.Allocate<double>(1);
  Combine(1, start_, 0, start_, current_);
  Combine(1, start_, 0, start_, previous_);
  BuildBlocks(monitor);
}

void MmSolver::BuildBlocks(Monitor& monitor) {
  Backend& backend = views_.backend();
  const size_t count = size_t(views_.NumActive());
  const size_t k = size_t(views_.num_coeffs());
  factors_ = {};  // before new ones take memory
  factors_ = backend.Allocate<float>(count * k * (k + 1) / 2);
  // Of the squares: pixels that stay count for more later, but are not pulled harder for that.
  Buffer<float> weights = backend.Allocate<float>(count);
  if (weights_.empty()) weights_ = weights;
  ViewSum sum(views_, ViewSum::Kind::kBlocks);
  for (const size_t v : views_.own_views()) {
    Progress(monitor, 0);
    const auto view = views_.Visit<MmView>(v);
    RefitScratch& scratch = views_.scratch();
    float* const curvature = scratch.images[1].data();
    if (stay_.slope > 0) {
      float* const image = scratch.images[0].data();
      views_.BlendChange(*view, current_.data(), scratch.features[0].data(),
                         scratch.features[1].data(), image);
      backend.refit().RegionResidual(*view->region, {.target = view->target.data(),
                                                     .unit = view->unit,
                                                     .image = image,
                                                     .residual = image,
                                                     .loss = loss_.data(),
                                                     .weights = view->weights.data(),
                                                     .stay = stay_,
                                                     .curvature = curvature});
    } else {
      backend.refit().RegionWeightImage(*view->region, view->weights.data(), curvature);
    }
    float* const weight = scratch.features[0].data();
    backend.blend().BlendTranspose(*view->region,
                                   {.residual = curvature, .channels = 1, .result = weight});
    sum.Add(v, *view, weight, nullptr, factors_);
  }
  sum.Finish(factors_);
  AddRidgeParams ridge{.blocks = factors_.data(),
                       .weights = weights.data(),
                       .count = int64_t(count),
                       .k = int32_t(k),
                       .ridge = {}};
  std::copy_n(ridge_, kMaxShCoeffs, ridge.ridge);
  backend.solve().AddRidge(ridge);
  backend.solve().FactorBlocks(
      {.blocks = factors_.data(), .count = int64_t(count), .k = int32_t(k)});
}

void MmSolver::Combine(float a, const Buffer<float>& x, float b, const Buffer<float>& y,
                       Buffer<float>& out) {
  views_.backend().solve().LinearCombination({.x = x.data(),
                                              .y = y.data(),
                                              .a = a,
                                              .b = b,
                                              .out = out.data(),
                                              .count = int64_t(views_.NumValues())});
}

double MmSolver::Dot(const Buffer<float>& x, const Buffer<float>& y) {
  return views_.backend().solve().Dot(x.data(), y.data(), int64_t(views_.NumValues()));
}

double MmSolver::RidgeTerm(const Buffer<float>& point, float* descent) {
  RidgeTermParams params{.weights = weights_.data(),
                         .x = point.data(),
                         .center = start_.data(),
                         .descent = descent,
                         .count = views_.NumActive(),
                         .k = views_.num_coeffs(),
                         .ridge = {}};
  std::copy_n(ridge_, kMaxShCoeffs, params.ridge);
  return views_.backend().solve().RidgeTerm(params);
}

void MmSolver::Precondition(const Buffer<float>& rhs) {
  views_.backend().solve().SolveBlocks({.factors = factors_.data(),
                                        .rhs = rhs.data(),
                                        .solution = solution_.data(),
                                        .count = views_.NumActive(),
                                        .k = views_.num_coeffs()});
}

void MmSolver::Progress(Monitor& monitor, size_t view) const {
  const double views = double(std::max<size_t>(views_.NumViews(), 1));
  monitor.Step("refit", double(iterations_) + double(view) / views, double(limit_));
}

// Phi at `point`; with_gradient also leaves half the negative gradient in gradient_.
double MmSolver::Evaluate(const Buffer<float>& point, bool with_gradient, Monitor& monitor) {
  Backend& backend = views_.backend();
  if (with_gradient) backend.Fill(gradient_.data(), 0, views_.NumValues() * sizeof(float));
  backend.Fill(loss_.data(), 0, sizeof(double));
  ViewSum gradient(views_, ViewSum::Kind::kGradient);
  const bool in_order = views_.reducer().AddsInOrder();
  std::vector<double> losses;  // of the own views, or their sum
  const auto take_loss = [&] {
    losses.push_back(backend.Download(loss_.data(), 1)[0]);
    backend.Fill(loss_.data(), 0, sizeof(double));
  };
  for (const size_t v : views_.own_views()) {
    Progress(monitor, v);
    const auto view = views_.Visit<MmView>(v);
    RefitScratch& scratch = views_.scratch();
    float* colors = scratch.features[0].data();
    float* change = scratch.features[1].data();
    views_.FindChange(*view, point.data(), colors, change);
    backend.refit().RegionSweep(*view->region, {.change = change,
                                                .target = view->target.data(),
                                                .unit = view->unit,
                                                .weights = view->weights.data(),
                                                .loss = loss_.data(),
                                                .image = scratch.images[0].data(),
                                                .result = with_gradient ? change : nullptr,
                                                .stay = stay_});
    if (in_order) take_loss();
    if (!with_gradient) continue;
    gradient.Add(v, *view, change, colors, gradient_);
  }
  if (with_gradient) gradient.Finish(gradient_);
  if (!in_order) take_loss();
  double loss = 0;
  for (const double one : views_.reducer().Gather<double>(losses)) loss += one;
  return loss + RidgeTerm(point, with_gradient ? gradient_.data() : nullptr);
}

double MmSolver::SmallGain() const {
  const double first = stay_.slope > 0 ? first_squares_ : losses_.front();
  return options_.tolerance * first * MmTargets::NumValues(views_);
}

bool MmSolver::StartsStaying(bool converged, Monitor& monitor) {
  const bool is_time = converged || iterations_ >= kSquaredSweeps;
  if (options_.outside_slope == 0 || stay_.slope > 0 || !is_time || iterations_ >= limit_) {
    return false;
  }
  stay_.slope = float(options_.outside_slope / 255);
  first_squares_ = losses_.front();
  // Is no sweep, so that progress does not go back.
  Monitor unheard([&](const retint::Progress&) { monitor.ThrowIfCancelled(); });
  losses_ = {Evaluate(start_, false, unheard) / MmTargets::NumValues(views_)};
  BuildBlocks(monitor);
  pairs_.clear();
  scale_ = 1;
  started_ = false;
  Combine(1, current_, 0, current_, previous_);
  return true;
}

// L-BFGS with the majoriser as its first guess of the curvature (Nocedal & Wright 2006, algorithm
// 7.4; preconditioned). Evaluates the trial point current_, goes from there to the minimum along
// the direction, and takes the next step from that.
bool MmSolver::Iterate(Monitor& monitor) {
  double loss = Evaluate(current_, true, monitor);
  ++iterations_;
  const bool first = !started_;
  if (!first) loss = GoToMinimum(loss);
  if (!first && loss > accepted_loss_ - kArmijo * length_ * slope_) return ShortenStep(loss);
  const double before = accepted_loss_;
  if (!first) RememberPair();
  started_ = true;
  accepted_loss_ = loss;
  losses_.push_back(loss / MmTargets::NumValues(views_));
  Combine(1, current_, 0, current_, previous_);
  std::swap(gradient_, accepted_gradient_);
  NextDirection();
  if (!(slope_ > 0)) return Finish(true, "nothing left to change");
  length_ = 1;
  Combine(1, previous_, 1, direction_, current_);
  const bool converged = !first && before - loss < SmallGain();
  if (StartsStaying(converged, monitor)) return true;
  if (converged) return FinishChecked(true, kSmallGain, monitor);
  return iterations_ < limit_ || FinishChecked(false, "all sweeps done", monitor);
}

// If no color is clamped, the loss is a parabola along the direction and the gradient a line. So
// both are known at the minimum without another look. Returns the loss there, or stays where it is.
double MmSolver::GoToMinimum(double loss) {
  const double curvature = (slope_ - Dot(gradient_, direction_)) / length_;
  const double parabola = accepted_loss_ + length_ * (length_ * curvature - 2 * slope_);
  const double best = slope_ / curvature;
  const bool is_parabola = std::abs(loss - parabola) < kClamped * length_ * slope_;
  if (!is_parabola || !(best > 0) || best > kLongestStep * length_) return loss;
  const float share = float(best / length_);
  Combine(1 - share, previous_, share, current_, current_);
  Combine(1 - share, accepted_gradient_, share, gradient_, gradient_);
  return accepted_loss_ - best * slope_;
}

// The trial was worse than promised: go back to the minimum of the parabola through it.
bool MmSolver::ShortenStep(double loss) {
  losses_.push_back(accepted_loss_ / MmTargets::NumValues(views_));
  const double rise = loss - accepted_loss_ + 2 * length_ * slope_;
  const double best = rise > 0 ? length_ * length_ * slope_ / rise : 0;
  length_ = std::clamp(best, 0.1 * length_, 0.5 * length_);
  Combine(1, previous_, float(length_), direction_, current_);
  if (iterations_ < limit_ && length_ > kShortestStep) return true;
  Combine(1, previous_, 0, previous_, current_);
  return Finish(iterations_ < limit_,
                iterations_ < limit_ ? "no step lowers the loss" : "all sweeps done");
}

// The newest pair from previous_ to current_, unless the curvature between them is not positive.
void MmSolver::RememberPair() {
  Pair pair;
  if (pairs_.size() == kMaxPairs) {
    pair = std::move(pairs_.front());
    pairs_.erase(pairs_.begin());
  } else {
    pair.s = views_.backend().Allocate<float>(views_.NumValues());
    pair.y = views_.backend().Allocate<float>(views_.NumValues());
  }
  Combine(1, current_, -1, previous_, pair.s);
  Combine(1, accepted_gradient_, -1, gradient_, pair.y);
  const double curvature = Dot(pair.s, pair.y);
  if (!(curvature > 0)) return;
  Precondition(pair.y);
  scale_ = curvature / Dot(pair.y, solution_);
  pair.rho = 1 / curvature;
  pairs_.push_back(std::move(pair));
}

// direction_ = (inverse curvature) accepted_gradient_, slope_ = its product with the gradient.
void MmSolver::NextDirection() {
  Combine(1, accepted_gradient_, 0, accepted_gradient_, gradient_);
  double products[kMaxPairs] = {};
  for (size_t i = pairs_.size(); i-- > 0;) {
    products[i] = pairs_[i].rho * Dot(pairs_[i].s, gradient_);
    Combine(1, gradient_, -float(products[i]), pairs_[i].y, gradient_);
  }
  Precondition(gradient_);
  Combine(float(pairs_.empty() ? 1 : scale_), solution_, 0, solution_, direction_);
  for (size_t i = 0; i < pairs_.size(); ++i) {
    const double product = pairs_[i].rho * Dot(pairs_[i].y, direction_);
    Combine(1, direction_, float(products[i] - product), pairs_[i].s, direction_);
  }
  slope_ = Dot(accepted_gradient_, direction_);
}

// Ends on the last trial point only where that is better than the last one evaluated.
bool MmSolver::FinishChecked(bool converged, const char* reason, Monitor& monitor) {
  const double loss = Evaluate(current_, false, monitor);
  if (loss > accepted_loss_) {
    Combine(1, previous_, 0, previous_, current_);
  } else {
    losses_.push_back(loss / MmTargets::NumValues(views_));
  }
  return Finish(converged, reason);
}

}  // namespace retint
