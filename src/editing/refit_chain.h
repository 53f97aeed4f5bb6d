// SPDX-License-Identifier: BSD-3-Clause
// The refit of several regions, one after the other: region k starts from the result of the regions
// before it, and aims at an edit of it. Regions whose fit is up to date are not fitted again.
#pragma once

#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "editing/background_optimizer.h"
#include "editing/region.h"
#include "render/renderer.h"
#include "scene/gaussian_model.h"

namespace retint {

// All that a chain reads. The pointers outlive it; nothing behind them changes meanwhile.
struct RefitChainInput {
  const GaussianModel* original = nullptr;
  RegionSet state;
  RefitJob job;
  // Training targets of each region of `state`, in its order; masks belong to its selections.
  std::vector<std::vector<RefitTarget>> targets;
};

class RefitChain : public OptimizerJob {
 public:
  // `renderer` outlives the chain; its coefficients are overwritten.
  RefitChain(RefitChainInput input, Renderer& renderer);
  ~RefitChain() override;

  // One sweep or step of the region at hand, or the preparation of the next one.
  bool Step(Monitor& monitor) override;
  ShSnapshot Snapshot() const override;
  const std::map<RegionId, std::shared_ptr<const RegionFit>>& fits() const { return fits_; }

 private:
  void Begin(Monitor& monitor);
  void Finish();

  // The scene after the regions before index_. If none of them was fitted it is the original, so
  // that a single region costs no copy of the scene.
  const GaussianModel& Current();
  FloatArray CurrentSh() const;

  RefitChainInput input_;
  Renderer& renderer_;
  GaussianModel working_;  // empty before it is first needed

  // Not applied to it yet.
  std::vector<std::shared_ptr<const RegionFit>> left_;
  size_t index_ = 0;
  std::unique_ptr<ShRefitter> refitter_;
  std::map<RegionId, std::shared_ptr<const RegionFit>> fits_;
};

// Coefficients after the visible regions of `state` from `first` on, starting from `sh`, [N,
// num_coeffs, 3]. A fit is used if its key is up to date, else closed forms, with layers as
// each Gaussian takes them by itself. If only the regions before a region have changed, its
// fit still holds for the Gaussians that none of them touches, so that an edit of one region
// does not move another. `original` is the scene's; only its layout and color space count. If
// shares and fits were reduced to a part of the scene, `gaussians` are that part's,
// ascending.
FloatArray ComposeSh(Backend& backend, const RegionSet& state, const RefitJob& job, size_t first,
                     size_t last, FloatArray sh, const GaussianModel& original,
                     std::span<const int32_t> gaussians = {});
// The scene without the parts of its file that no kernel reads.
GaussianModel WithoutExtras(const GaussianModel& model);

}  // namespace retint
