// SPDX-License-Identifier: BSD-3-Clause
#include "recolor/mm_solver.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/error.h"

namespace retint {
namespace {

constexpr int kDefaultSweeps = 10;
// The clamp at 0 can make a step of conjugate gradients overshoot; it is halved this many times
// before it is given up.
constexpr int kMaxHalvings = 5;

}  // namespace

MmSolver::MmSolver(RefitProblem& problem, const RefitOptions& options, Monitor& monitor)
    : problem_(problem),
      options_(options),
      limit_(options.iterations > 0 ? options.iterations : kDefaultSweeps) {
  Backend& backend = problem_.backend();
  for (int k = 0; k < problem_.num_coeffs(); ++k) {
    ridge_[k] = float(k == 0 ? options.ridge_dc : options.ridge_rest);
  }
  const size_t values = problem_.NumValues();
  start_ = backend.Upload(std::span<const float>(problem_.start()));
  current_ = backend.Upload(std::span<const float>(problem_.start()));
  for (auto* buffer : {&previous_, &point_, &gradient_, &solution_}) {
    *buffer = backend.Allocate<float>(values);
  }
  if (options.acceleration == MmAcceleration::kConjugateGradients) {
    direction_ = backend.Allocate<float>(values);
    product_ = backend.Allocate<float>(values);
  }
  loss_ = backend.Allocate<double>(1);
  Combine(1, current_, 0, current_, previous_);
  BuildBlocks(monitor);
}

void MmSolver::BuildBlocks(Monitor& monitor) {
  Backend& backend = problem_.backend();
  const size_t count = size_t(problem_.NumActive());
  const size_t k = size_t(problem_.num_coeffs());
  factors_ = backend.Allocate<float>(count * k * (k + 1) / 2);
  weights_ = backend.Allocate<float>(count);
  for (size_t v = 0; v < problem_.NumViews(); ++v) {
    monitor.Step("refit", 0, 1);
    const auto view = problem_.Visit(v);
    const CameraParams& camera = view->region->camera();
    const size_t pixels = size_t(camera.width) * size_t(camera.height);
    RefitScratch& scratch = problem_.scratch();
    const std::vector<float> ones(pixels, 1.0f);
    backend.CopyToDevice(scratch.images[0].data(), ones.data(), pixels * sizeof(float));
    BlendTransposeParams transpose{};
    transpose.residual = scratch.images[0].data();
    transpose.channels = 1;
    transpose.result = scratch.features[0].data();
    backend.BlendTranspose(*view->region, transpose);
    AccumulateBlocksParams blocks{};
    blocks.rows = view->region->rows();
    blocks.slots = view->slots.data();
    blocks.count = view->region->num_rows();
    blocks.weights = scratch.features[0].data();
    std::copy_n(camera.center, 3, blocks.center);
    blocks.blocks = factors_.data();
    backend.AccumulateBlocks(problem_.model(), blocks);
  }
  AddRidgeParams ridge{};
  ridge.blocks = factors_.data();
  ridge.weights = weights_.data();
  ridge.count = int64_t(count);
  ridge.k = int32_t(k);
  std::copy_n(ridge_, kMaxShCoeffs, ridge.ridge);
  backend.AddRidge(ridge);
  FactorBlocksParams factor{};
  factor.blocks = factors_.data();
  factor.count = int64_t(count);
  factor.k = int32_t(k);
  backend.FactorBlocks(factor);
}

void MmSolver::Combine(float a, const Buffer<float>& x, float b, const Buffer<float>& y,
                       Buffer<float>& out) {
  LinearCombinationParams params{};
  params.x = x.data();
  params.y = y.data();
  params.a = a;
  params.b = b;
  params.out = out.data();
  params.count = int64_t(problem_.NumValues());
  problem_.backend().LinearCombination(params);
}

double MmSolver::Dot(const Buffer<float>& x, const Buffer<float>& y) {
  return problem_.backend().Dot(x.data(), y.data(), int64_t(problem_.NumValues()));
}

void MmSolver::AddRidgeTerm(const Buffer<float>& x, float scale, Buffer<float>& out) {
  ApplyRidgeParams params{};
  params.weights = weights_.data();
  params.x = x.data();
  params.out = out.data();
  params.count = problem_.NumActive();
  params.k = problem_.num_coeffs();
  params.scale = scale;
  std::copy_n(ridge_, kMaxShCoeffs, params.ridge);
  problem_.backend().ApplyRidge(params);
}

void MmSolver::Precondition() {
  SolveBlocksParams params{};
  params.factors = factors_.data();
  params.rhs = gradient_.data();
  params.solution = solution_.data();
  params.count = problem_.NumActive();
  params.k = problem_.num_coeffs();
  problem_.backend().SolveBlocks(params);
}

void MmSolver::Progress(Monitor& monitor, size_t view) const {
  const double views = double(std::max<size_t>(problem_.NumViews(), 1));
  monitor.Step("refit", double(iterations_) + double(view) / views, double(limit_));
}

// Phi at `point`; with_gradient also leaves half the negative gradient in gradient_.
double MmSolver::Evaluate(const Buffer<float>& point, bool with_gradient, Monitor& monitor) {
  Backend& backend = problem_.backend();
  const size_t values = problem_.NumValues();
  if (with_gradient) backend.Fill(gradient_.data(), 0, values * sizeof(float));
  backend.Fill(loss_.data(), 0, sizeof(double));
  for (size_t v = 0; v < problem_.NumViews(); ++v) {
    Progress(monitor, v);
    const auto view = problem_.Visit(v);
    RefitScratch& scratch = problem_.scratch();
    float* colors = scratch.features[0].data();
    float* change = scratch.features[1].data();
    float* image = scratch.images[0].data();
    problem_.EvalColors(*view, point.data(), colors);
    LinearCombinationParams difference{};
    difference.x = colors;
    difference.y = view->base_colors.data();
    difference.a = 1;
    difference.b = -1;
    difference.out = change;
    difference.count = view->region->num_rows() * 3;
    backend.LinearCombination(difference);
    BlendParams blend{};
    blend.features = change;
    blend.channels = 3;
    blend.image = image;
    blend.keep_outside = true;
    backend.Blend(*view->region, blend);
    RegionResidualParams residual{};
    residual.target = view->target.data();
    residual.unit = problem_.target_unit();
    residual.image = image;
    residual.residual = image;
    residual.loss = loss_.data();
    backend.RegionResidual(*view->region, residual);
    if (!with_gradient) continue;
    BlendTransposeParams transpose{};
    transpose.residual = image;
    transpose.channels = 3;
    transpose.result = change;
    backend.BlendTranspose(*view->region, transpose);
    problem_.AddShGradient(*view, change, colors, gradient_.data());
  }
  double loss = 0;
  backend.CopyToHost(&loss, loss_.data(), sizeof(double));
  // The ridge: solution_ and point_'s difference serve as scratch, both are rewritten by callers.
  Buffer<float>& ridge = solution_;
  backend.Fill(ridge.data(), 0, values * sizeof(float));
  AddRidgeTerm(point, 1, ridge);
  AddRidgeTerm(start_, -1, ridge);
  loss += Dot(ridge, point) - Dot(ridge, start_);
  if (with_gradient) Combine(1, gradient_, -1, ridge, gradient_);
  return loss;
}

// product_ = H direction_, H = sum_v Y^T G W^T W G Y + ridge V, with the gates G of the colours at
// previous_, where the problem was linearised.
void MmSolver::ApplyNormalMatrix(Monitor& monitor) {
  Backend& backend = problem_.backend();
  backend.Fill(product_.data(), 0, problem_.NumValues() * sizeof(float));
  for (size_t v = 0; v < problem_.NumViews(); ++v) {
    Progress(monitor, v);
    const auto view = problem_.Visit(v);
    RefitScratch& scratch = problem_.scratch();
    float* colors = scratch.features[0].data();
    float* tangents = scratch.features[1].data();
    float* image = scratch.images[0].data();
    problem_.EvalColors(*view, previous_.data(), colors);
    ShTangentParams tangent{};
    tangent.rows = view->region->rows();
    tangent.slots = view->slots.data();
    tangent.count = view->region->num_rows();
    tangent.direction = direction_.data();
    tangent.colors = colors;
    std::copy_n(view->region->camera().center, 3, tangent.center);
    tangent.tangents = tangents;
    backend.ShTangent(problem_.model(), tangent);
    BlendParams blend{};
    blend.features = tangents;
    blend.channels = 3;
    blend.image = image;
    blend.keep_outside = true;
    backend.Blend(*view->region, blend);
    BlendTransposeParams transpose{};
    transpose.residual = image;
    transpose.channels = 3;
    transpose.result = tangents;
    backend.BlendTranspose(*view->region, transpose);
    problem_.AddShGradient(*view, tangents, colors, product_.data());
  }
  AddRidgeTerm(direction_, 1, product_);
}

bool MmSolver::Finish(bool converged, const char* reason) {
  finished_ = true;
  converged_ = converged;
  reason_ = reason;
  return false;
}

bool MmSolver::Step(Monitor& monitor) {
  if (finished_) return false;
  if (problem_.NumActive() == 0) return Finish(true, "the masks touch no Gaussian");
  if (options_.acceleration != MmAcceleration::kConjugateGradients) return SimpleStep(monitor);
  return linearized_ ? ConjugateStep(monitor) : Linearize(monitor);
}

// A majoriser step from the current point, or from Nesterov's extrapolation of the last two, which
// restarts when the loss rises (O'Donoghue & Candes 2015).
bool MmSolver::SimpleStep(Monitor& monitor) {
  const bool accelerate = options_.acceleration == MmAcceleration::kNesterov;
  const double next_momentum = 0.5 * (1 + std::sqrt(1 + 4 * momentum_ * momentum_));
  const float extrapolate = accelerate ? float((momentum_ - 1) / next_momentum) : 0.0f;
  Combine(1 + extrapolate, current_, -extrapolate, previous_, point_);
  const double loss = Evaluate(point_, true, monitor);
  ++iterations_;
  const double before = losses_.empty() ? loss : losses_.back() * problem_.NumTargetValues();
  if (extrapolate > 0 && loss > before) {
    momentum_ = 1;
    Combine(1, current_, 0, current_, previous_);
    if (iterations_ >= limit_) return Finish(false, "all sweeps done");
    return true;
  }
  const bool first = losses_.empty();
  losses_.push_back(loss / problem_.NumTargetValues());
  Precondition();
  const double expected = Dot(gradient_, solution_);
  std::swap(previous_, current_);
  Combine(1, point_, 1, solution_, current_);
  momentum_ = next_momentum;
  if (expected <= 0) return Finish(true, "nothing left to change");
  if (!first && before - loss < options_.tolerance * before) {
    return Finish(true, "a sweep lowered the loss by less than the tolerance");
  }
  if (iterations_ >= limit_) return Finish(false, "all sweeps done");
  return true;
}

// Starts a run of conjugate gradients at the current point, or, where that turned out worse than
// the last start, goes half the way back.
bool MmSolver::Linearize(Monitor& monitor) {
  const double loss = Evaluate(current_, true, monitor);
  ++iterations_;
  losses_.push_back(loss / problem_.NumTargetValues());
  base_loss_ = model_loss_ = loss;
  Precondition();
  rho_ = Dot(gradient_, solution_);
  if (rho_ <= 0) return Finish(true, "nothing left to change");
  Combine(1, current_, 0, current_, previous_);
  Combine(1, solution_, 0, solution_, direction_);
  linearized_ = true;
  if (iterations_ < limit_) return true;
  // A single sweep: the majoriser's unit step.
  Combine(1, current_, 1, solution_, current_);
  return EndSegment(false, monitor);
}

bool MmSolver::ConjugateStep(Monitor& monitor) {
  ApplyNormalMatrix(monitor);
  ++iterations_;
  const double curvature = Dot(direction_, product_);
  if (!(curvature > 0)) return EndSegment(true, monitor);
  const double length = rho_ / curvature;
  Combine(1, current_, float(length), direction_, current_);
  Combine(1, gradient_, -float(length), product_, gradient_);
  const double before = model_loss_;
  model_loss_ -= length * rho_;
  losses_.push_back(model_loss_ / problem_.NumTargetValues());
  Precondition();
  const double rho = Dot(gradient_, solution_);
  Combine(1, solution_, float(rho / rho_), direction_, direction_);
  rho_ = rho;
  const bool settled = before - model_loss_ < options_.tolerance * before || !(rho > 0);
  if (settled || iterations_ >= limit_) return EndSegment(settled, monitor);
  return true;
}

// Compares the linear model with the true loss. Where the clamp spoiled the step, shortens it;
// where the two still differ, linearises again.
bool MmSolver::EndSegment(bool settled, Monitor& monitor) {
  linearized_ = false;
  double loss = Evaluate(current_, false, monitor);
  for (int halving = 0; loss > base_loss_ && halving < kMaxHalvings; ++halving) {
    Combine(0.5f, current_, 0.5f, previous_, current_);
    loss = Evaluate(current_, false, monitor);
  }
  if (loss > base_loss_) {
    Combine(1, previous_, 0, previous_, current_);
    return Finish(true, "no step lowers the loss");
  }
  losses_.back() = loss / problem_.NumTargetValues();
  if (iterations_ >= limit_ && !settled) return Finish(false, "all sweeps done");
  const bool agrees = loss - model_loss_ < options_.tolerance * base_loss_;
  if (agrees || base_loss_ - loss < options_.tolerance * base_loss_) {
    return Finish(true, "a sweep lowered the loss by less than the tolerance");
  }
  if (iterations_ >= limit_) return Finish(false, "all sweeps done");
  return true;
}

}  // namespace retint
