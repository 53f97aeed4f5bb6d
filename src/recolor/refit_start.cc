// SPDX-License-Identifier: BSD-3-Clause
#include "recolor/refit_start.h"

#include <algorithm>

#include "base/parallel.h"
#include "recolor/view_sum.h"

namespace retint {
namespace {

// How much of the edit a Gaussian starts with that has a share `s` of its weight inside the masks:
// s^2 / (s^2 + (1 - s)^2). With s itself, large and faint Gaussians would carry a part of the edit
// far out. Sweeps take it back only slowly there: it costs little per pixel, but in very many.
// Inside, the others make up for it at once.
std::vector<float> StartShares(std::span<const float> shares) {
  std::vector<float> starts;
  starts.reserve(shares.size());
  for (const float s : shares) starts.push_back(s * s / (s * s + (1 - s) * (1 - s)));
  return starts;
}

// sh [active, K, 3] += the solution of one K x K least squares for each Gaussian. It is the change
// of its coefficients that brings its colors, in the views that see it, to the edited ones. A ridge
// keeps the directions that no view sees.
void FitToViews(RefitViews& views, Buffer<float>& sh, Monitor& monitor) {
  constexpr float kRidge = 1e-3f;
  Backend& backend = views.backend();
  SolveOps& solve = backend.solve();
  const int64_t count = views.NumActive();
  const int32_t k = views.num_coeffs();
  size_t most_rows = 0;
  for (const size_t v : views.own_views()) {
    most_rows = std::max(most_rows, size_t(views.Visit(v)->region->num_rows()));
  }
  const auto ones = backend.Upload(std::span<const float>(std::vector<float>(most_rows, 1.0f)));
  const auto whole = backend.Upload(std::span<const uint8_t>(std::vector<uint8_t>(most_rows, 255)));
  auto rhs = backend.Allocate<float>(views.NumValues());
  const auto change = backend.Allocate<float>(views.NumValues());
  const auto weights = backend.Allocate<float>(size_t(count));
  auto blocks = backend.Allocate<float>(size_t(count) * size_t(k) * size_t(k + 1) / 2);
  ViewSum right(views, ViewSum::Kind::kGradient), normal(views, ViewSum::Kind::kBlocks);
  for (const size_t v : views.own_views()) {
    monitor.Step("refit", 0, 1);
    const auto view = views.Visit(v);
    const auto rows = int32_t(view->region->num_rows());
    float* const wanted = views.scratch().features[0].data();
    float* const colors = views.scratch().features[1].data();
    backend.refit().EditImage({.image = view->base_colors.data(),
                               .mask = whole.data(),
                               .map = views.map(),
                               .width = rows,
                               .height = 1,
                               .box = {0, 0, rows, 1},
                               .out = wanted});
    views.EvalColors(*view, sh.data(), colors);
    solve.LinearCombination(
        {.x = wanted, .y = colors, .a = 1, .b = -1, .out = wanted, .count = int64_t{rows} * 3});
    right.Add(v, *view, wanted, nullptr, rhs);
    normal.Add(v, *view, ones.data(), nullptr, blocks);
  }
  right.Finish(rhs);
  normal.Finish(blocks);
  AddRidgeParams ridge{
      .blocks = blocks.data(), .weights = weights.data(), .count = count, .k = k, .ridge = {}};
  std::fill_n(ridge.ridge, k, kRidge);
  solve.AddRidge(ridge);
  solve.FactorBlocks({.blocks = blocks.data(), .count = count, .k = k});
  solve.SolveBlocks({.factors = blocks.data(),
                     .rhs = rhs.data(),
                     .solution = change.data(),
                     .count = count,
                     .k = k});
  solve.LinearCombination({.x = sh.data(),
                           .y = change.data(),
                           .a = 1,
                           .b = 1,
                           .out = sh.data(),
                           .count = int64_t(views.NumValues())});
}

// An affine edit has an exact closed form. Of any other, the coefficients are fitted to the edited
// colors in the directions of the views that see the Gaussian; where these say nothing, to those
// all around it.
void FitColors(RefitViews& views, const ColorEdit& edit, std::span<const float> starts,
               std::span<float> start, Monitor& monitor) {
  Backend& backend = views.backend();
  const int num_coeffs = views.num_coeffs();
  const size_t block = size_t(num_coeffs) * 3;
  const std::span<const float> original = views.original();
  ParallelRanges(views.NumActive(), 4096, [&](int64_t begin, int64_t end) {
    std::copy(&original[size_t(begin) * block], &original[size_t(end) * block],
              &start[size_t(begin) * block]);
  });
  if (edit.IsAffine() || start.empty()) {
    ApplyClosedForm(backend, start, num_coeffs, starts, edit, 0);  // all of these are active
    return;
  }
  const std::vector<float> ones(starts.size(), 1.0f);
  ApplyClosedForm(backend, start, num_coeffs, ones, edit, 0);
  Buffer<float> sh = backend.Upload(std::span<const float>(start));
  FitToViews(views, sh, monitor);
  backend.CopyToHost(start.data(), sh.data(), start.size_bytes());
  ParallelRanges(views.NumActive(), 4096, [&](int64_t begin, int64_t end) {
    for (size_t i = size_t(begin) * block; i < size_t(end) * block; ++i) {
      const float full = start[i];
      start[i] = original[i];
      start[i] += starts[i / block] * (full - original[i]);
    }
  });
}

}  // namespace

std::unique_ptr<float[]> FitStart(RefitViews& views, const ColorEdit& edit,
                                  const GaussianPaint* paint, std::span<const float> shares,
                                  Monitor& monitor) {
  const std::vector<float> starts = StartShares(shares);
  auto start = std::make_unique_for_overwrite<float[]>(views.NumValues());
  const std::span<float> values(start.get(), views.NumValues());
  FitColors(views, edit, starts, values, monitor);
  PaintChange(views.original(), views.num_coeffs(), starts, edit, paint, 0, views.active())
      .AddTo(values);
  return start;
}

}  // namespace retint
