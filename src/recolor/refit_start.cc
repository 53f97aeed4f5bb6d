// SPDX-License-Identifier: BSD-3-Clause
// Where a fit starts: the edit of each active Gaussian's own colors.
#include <algorithm>

#include "base/parallel.h"
#include "recolor/refit_problem.h"
#include "recolor/view_sum.h"

namespace retint {

namespace {

// How much of the edit a Gaussian starts with that has a share `s` of its weight inside the masks:
// s^2 / (s^2 + (1 - s)^2). With s itself, large and faint Gaussians would carry a part of the edit
// far out, where sweeps take it back only slowly: it costs little per pixel, but in very many.
// Inside, the others make up for it at once.
std::vector<float> StartShares(std::span<const float> shares) {
  std::vector<float> starts;
  starts.reserve(shares.size());
  for (const float s : shares) starts.push_back(s * s / (s * s + (1 - s) * (1 - s)));
  return starts;
}

}  // namespace

void RefitProblem::FitStart(const ColorEdit& edit, const GaussianPaint* paint,
                            std::span<const float> shares, Monitor& monitor) {
  const std::vector<float> starts = StartShares(shares);
  FitColors(edit, starts, monitor);
  PaintChange(original(), num_coeffs_, starts, edit, paint, 0, active_)
      .AddTo({start_.get(), NumValues()});
}

// An affine edit has an exact closed form. Of any other, the coefficients are fitted to the edited
// colors in the directions of the views that see the Gaussian; where these say nothing, to those
// all around it.
void RefitProblem::FitColors(const ColorEdit& edit, std::span<const float> starts,
                             Monitor& monitor) {
  const size_t block = size_t(num_coeffs_) * 3;
  start_ = std::make_unique_for_overwrite<float[]>(NumValues());
  ParallelRanges(NumActive(), 4096, [&](int64_t begin, int64_t end) {
    std::copy(&original_[size_t(begin) * block], &original_[size_t(end) * block],
              &start_[size_t(begin) * block]);
  });
  const std::span<float> start(start_.get(), NumValues());
  if (edit.IsAffine() || active_.empty()) {
    ApplyClosedForm(backend(), start, num_coeffs_, starts, edit, 0);  // all of these are active
    return;
  }
  const std::vector<float> ones(starts.size(), 1.0f);
  ApplyClosedForm(backend(), start, num_coeffs_, ones, edit, 0);
  Buffer<float> sh = backend().Upload(std::span<const float>(start));
  FitToViews(sh, monitor);
  backend().CopyToHost(start.data(), sh.data(), start.size_bytes());
  ParallelRanges(NumActive(), 4096, [&](int64_t begin, int64_t end) {
    for (size_t i = size_t(begin) * block; i < size_t(end) * block; ++i) {
      const float original = original_[i], full = start[i];
      start[i] = original;
      start[i] += starts[i / block] * (full - original);
    }
  });
}

// sh [active, K, 3] += the solution of one K x K least squares a Gaussian: the change of its
// coefficients that brings its colors, in the views that see it, to the edited ones. A ridge keeps
// what no view sees.
void RefitProblem::FitToViews(Buffer<float>& sh, Monitor& monitor) {
  constexpr float kRidge = 1e-3f;
  const size_t k = size_t(num_coeffs_);
  size_t most_rows = 0;
  for (const size_t v : own_views_) {
    most_rows = std::max(most_rows, size_t(Visit(v)->region->num_rows()));
  }
  const auto ones = backend().Upload(std::span<const float>(std::vector<float>(most_rows, 1.0f)));
  const auto whole =
      backend().Upload(std::span<const uint8_t>(std::vector<uint8_t>(most_rows, 255)));
  auto rhs = backend().Allocate<float>(NumValues());
  const auto change = backend().Allocate<float>(NumValues());
  const auto weights = backend().Allocate<float>(active_.size());
  auto blocks = backend().Allocate<float>(active_.size() * k * (k + 1) / 2);
  ViewSum right(*this, ViewSum::Kind::kGradient), normal(*this, ViewSum::Kind::kBlocks);
  for (const size_t v : own_views_) {
    monitor.Step("refit", 0, 1);
    const auto view = Visit(v);
    const int64_t rows = view->region->num_rows();
    float* wanted = scratch_.features[0].data();
    float* colors = scratch_.features[1].data();
    EditImageParams edited{};
    edited.image = view->base_colors.data();
    edited.mask = whole.data();
    edited.map = map();
    edited.width = edited.box[2] = int32_t(rows);
    edited.height = edited.box[3] = 1;
    edited.out = wanted;
    backend().refit().EditImage(edited);
    EvalColors(*view, sh.data(), colors);
    LinearCombinationParams difference{};
    difference.x = wanted;
    difference.y = colors;
    difference.a = 1;
    difference.b = -1;
    difference.out = wanted;
    difference.count = rows * 3;
    backend().solve().LinearCombination(difference);
    right.Add(v, *view, wanted, nullptr, rhs);
    normal.Add(v, *view, ones.data(), nullptr, blocks);
  }
  right.Finish(rhs);
  normal.Finish(blocks);
  AddRidgeParams ridge{};
  ridge.blocks = blocks.data();
  ridge.weights = weights.data();
  ridge.count = NumActive();
  ridge.k = num_coeffs_;
  std::fill_n(ridge.ridge, k, kRidge);
  backend().solve().AddRidge(ridge);
  FactorBlocksParams factor{};
  factor.blocks = blocks.data();
  factor.count = NumActive();
  factor.k = num_coeffs_;
  backend().solve().FactorBlocks(factor);
  SolveBlocksParams solve{};
  solve.factors = blocks.data();
  solve.rhs = rhs.data();
  solve.solution = change.data();
  solve.count = NumActive();
  solve.k = num_coeffs_;
  backend().solve().SolveBlocks(solve);
  LinearCombinationParams sum{};
  sum.x = sh.data();
  sum.y = change.data();
  sum.a = sum.b = 1;
  sum.out = sh.data();
  sum.count = int64_t(NumValues());
  backend().solve().LinearCombination(sum);
}

}  // namespace retint
