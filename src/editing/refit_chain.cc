// SPDX-License-Identifier: BSD-3-Clause
#include "editing/refit_chain.h"

#include <algorithm>
#include <cstddef>
#include <string>
#include <utility>

#include "base/parallel.h"

namespace retint {
namespace {

// Whether the region's fit is of its own selection, edit and strength, whatever the regions before
// it are now.
bool IsOwnFit(const Region& region, const RefitJob& job) {
  const std::string options = OptionKey(Described(job));
  const std::string own = RegionSet{{region}}.FitKey(0, job).substr(options.size());
  return region.fit && region.fit->key.starts_with(options) && region.fit->key.ends_with(own);
}

// Of the fit of regions[index], the Gaussians that no region before it touches, to `sh`.
void ApplyAlone(const RegionSet& state, size_t index, double threshold, int num_coeffs,
                FloatArray* sh) {
  const RegionFit& fit = *state.regions[index].fit;
  const size_t block = size_t(num_coeffs) * 3;
  constexpr int64_t kGaussians = 1024;  // a task
  ParallelRanges(int64_t(fit.indices.size()), kGaussians, [&](int64_t begin, int64_t end) {
    for (auto i = size_t(begin); i < size_t(end); ++i) {
      const auto g = size_t(fit.indices[i]);
      const bool shared = std::any_of(
          state.regions.begin(), state.regions.begin() + std::ptrdiff_t(index),
          [&](const Region& other) { return double(other.selection->shares[g]) > threshold; });
      if (!shared) std::copy_n(&fit.sh[i * block], block, &(*sh)[g * block]);
    }
  });
}

// Whether every Gaussian takes all of the region's edit, and that is an affine map of colors. Then
// its closed form is exact, as blending and spherical harmonics are linear.
bool IsExact(const Region& region, const GaussianModel& original) {
  const ColorEdit edit = region.EffectiveEdit().OnColorsOf(original);
  return edit.IsAffine() && !edit.HasPaint() &&
         std::ranges::all_of(region.selection->shares, [](float share) { return share == 1; });
}

}  // namespace

GaussianModel WithoutExtras(const GaussianModel& model) {
  GaussianModel copy;
  copy.sh_degree = model.sh_degree;
  copy.means = model.means;
  copy.quats_wxyz = model.quats_wxyz;
  copy.log_scales = model.log_scales;
  copy.opacity_logits = model.opacity_logits;
  copy.sh = model.sh;
  copy.traits = model.traits;
  return copy;
}

FloatArray ComposeSh(Backend& backend, const RegionSet& state, const RefitJob& job, size_t first,
                     size_t last, FloatArray sh, const GaussianModel& original,
                     std::span<const int32_t> gaussians) {
  const int num_coeffs = original.NumShCoeffs();
  for (size_t i = first; i < last; ++i) {
    const Region& region = state.regions[i];
    if (!region.visible) continue;
    if (region.fit && region.fit->key == state.FitKey(i, job)) {
      region.fit->Apply(sh, num_coeffs);
      continue;
    }
    const std::vector<float>& shares = region.selection->shares;
    const ColorEdit edit = region.EffectiveEdit().OnColorsOf(original);
    const double threshold = job.options.active_threshold;
    const PaintChange paint(sh, num_coeffs, shares, edit, region.paint.get(), threshold, gaussians);
    ApplyClosedForm(backend, sh, num_coeffs, shares, edit, threshold);
    paint.AddTo(sh);
    if (IsOwnFit(region, job)) ApplyAlone(state, i, threshold, num_coeffs, &sh);
  }
  return sh;
}

RefitChain::RefitChain(RefitChainInput input, Renderer& renderer)
    : input_(std::move(input)), renderer_(renderer) {}

RefitChain::~RefitChain() = default;

bool RefitChain::Step(Monitor& monitor) {
  const auto& regions = input_.state.regions;
  while (index_ < regions.size()) {
    const Region& region = regions[index_];
    if (!region.visible) {
      ++index_;
      continue;
    }
    if (!refitter_ && IsExact(region, *input_.original)) {
      FloatArray sh = ComposeSh(renderer_.backend(), input_.state, input_.job, index_, index_ + 1,
                                CurrentSh(), *input_.original);
      if (working_.sh.empty()) working_ = WithoutExtras(*input_.original);
      working_.sh = std::move(sh);
      left_.clear();
      ++index_;
      continue;
    }
    if (!refitter_ && region.fit && region.fit->key == input_.state.FitKey(index_, input_.job)) {
      left_.push_back(region.fit);
      ++index_;
      continue;
    }
    if (!refitter_) {
      Begin(monitor);
      return true;
    }
    if (refitter_->Step(monitor)) return true;
    Finish();
  }
  return false;
}

const GaussianModel& RefitChain::Current() {
  if (left_.empty() && working_.sh.empty()) return *input_.original;
  if (working_.sh.empty()) working_ = WithoutExtras(*input_.original);
  for (const auto& fit : left_) fit->Apply(working_.sh, working_.NumShCoeffs());
  left_.clear();
  return working_;
}

FloatArray RefitChain::CurrentSh() const {
  FloatArray sh = working_.sh.empty() ? input_.original->sh : working_.sh;
  for (const auto& fit : left_) fit->Apply(sh, input_.original->NumShCoeffs());
  return sh;
}

void RefitChain::Begin(Monitor& monitor) {
  const Region& region = input_.state.regions[index_];
  refitter_ = std::make_unique<ShRefitter>(renderer_, Current(), input_.targets[index_],
                                           region.EffectiveEdit(), region.selection->shares,
                                           input_.job.options, monitor, region.paint.get());
}

void RefitChain::Finish() {
  const Region& region = input_.state.regions[index_];
  auto fit = std::make_shared<RegionFit>();
  fit->key = input_.state.FitKey(index_, input_.job);
  const auto active = refitter_->active();
  fit->indices.assign(active.begin(), active.end());
  fit->sh = refitter_->ActiveSh();
  fit->summary = refitter_->Summary(fit->sh);
  refitter_.reset();  // it looks at working_
  left_.push_back(fit);
  fits_[region.id] = std::move(fit);
  ++index_;
}

ShSnapshot RefitChain::Snapshot() const {
  ShSnapshot snapshot;
  snapshot.fits = fits_;
  if (refitter_) {
    snapshot.region = input_.state.regions[index_].id;
    snapshot.losses = refitter_->losses();
  }
  // Regions without a fit show their closed form, so that the first snapshot is the whole preview.
  FloatArray sh = refitter_ ? refitter_->Sh() : CurrentSh();
  const size_t next = refitter_ ? index_ + 1 : index_;
  const auto& regions = input_.state.regions;
  sh = ComposeSh(renderer_.backend(), input_.state, input_.job, next, regions.size(), std::move(sh),
                 *input_.original);
  snapshot.sh = std::make_shared<const FloatArray>(std::move(sh));
  return snapshot;
}

}  // namespace retint
