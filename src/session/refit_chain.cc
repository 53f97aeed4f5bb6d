// SPDX-License-Identifier: BSD-3-Clause
#include "session/refit_chain.h"

#include <utility>

namespace retint {

GaussianModel WithoutExtras(const GaussianModel& model) {
  GaussianModel copy;
  copy.sh_degree = model.sh_degree;
  copy.means = model.means;
  copy.quats_wxyz = model.quats_wxyz;
  copy.log_scales = model.log_scales;
  copy.opacity_logits = model.opacity_logits;
  copy.sh = model.sh;
  return copy;
}

std::vector<float> ComposeSh(const RegionSet& state, const RefitJob& job, size_t first, size_t last,
                             std::vector<float> sh, int num_coeffs) {
  for (size_t i = first; i < last; ++i) {
    const Region& region = state.regions[i];
    if (!region.visible) continue;
    if (region.fit && region.fit->key == state.FitKey(i, job)) {
      region.fit->Apply(sh, num_coeffs);
      continue;
    }
    sh = ClosedFormSh(std::move(sh), num_coeffs, region.selection->shares, region.EffectiveEdit(),
                      job.options.active_threshold);
  }
  return sh;
}

RefitChain::RefitChain(RefitChainInput input, Renderer& renderer)
    : input_(std::move(input)), renderer_(renderer), working_(WithoutExtras(*input_.original)) {}

RefitChain::~RefitChain() = default;

bool RefitChain::Step(Monitor& monitor) {
  const auto& regions = input_.state.regions;
  while (index_ < regions.size()) {
    const Region& region = regions[index_];
    if (!region.visible) {
      ++index_;
      continue;
    }
    if (!refitter_ && region.fit && region.fit->key == input_.state.FitKey(index_, input_.job)) {
      region.fit->Apply(working_.sh, working_.NumShCoeffs());
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

void RefitChain::Begin(Monitor& monitor) {
  const Region& region = input_.state.regions[index_];
  refitter_ = std::make_unique<ShRefitter>(renderer_, working_, input_.targets[index_],
                                           region.EffectiveEdit(), region.selection->shares,
                                           input_.job.options, monitor);
}

void RefitChain::Finish() {
  const Region& region = input_.state.regions[index_];
  auto fit = std::make_shared<RegionFit>();
  fit->key = input_.state.FitKey(index_, input_.job);
  fit->summary = refitter_->Summary();
  const auto active = refitter_->active();
  fit->indices.assign(active.begin(), active.end());
  fit->sh = refitter_->ActiveSh();
  refitter_.reset();  // it looks at working_
  fit->Apply(working_.sh, working_.NumShCoeffs());
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
  // What is not fitted yet shows its closed form, so that the first snapshot is the whole preview.
  std::vector<float> sh = refitter_ ? refitter_->Sh() : working_.sh;
  const size_t next = refitter_ ? index_ + 1 : index_;
  const auto& regions = input_.state.regions;
  sh = ComposeSh(input_.state, input_.job, next, regions.size(), std::move(sh),
                 working_.NumShCoeffs());
  snapshot.sh = std::make_shared<const std::vector<float>>(std::move(sh));
  return snapshot;
}

}  // namespace retint
