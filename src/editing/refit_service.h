// SPDX-License-Identifier: BSD-3-Clause
// The fits of a scene's regions, in the foreground or on a thread of its own, the coefficients that
// they make, and the effect of an edit on the views.
//
// The background optimizer works on copies and renders through a Renderer of its own;
// NewestSnapshot(), which any thread may call, fetches its results.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "editing/background_optimizer.h"
#include "editing/refit_chain.h"
#include "editing/region_store.h"
#include "opening/open_scene.h"
#include "recolor/quality_report.h"
#include "scene/gaussian_model.h"

namespace retint {

class RefitService {
 public:
  RefitService(OpenScene& scene, RegionStore& store) : scene_(scene), store_(store) {}

  // Refits every visible region whose fit is out of date, in order, here and now.
  void Refit(const RefitJob& job, Monitor& monitor);
  // The same on the background thread, starting from the regions that are up to date. Snapshots
  // begin with the closed form. Photos, where they are the target, are read before this returns.
  uint64_t Start(const RefitJob& job, Monitor& monitor);
  BackgroundOptimizer& optimizer();
  std::shared_ptr<const ShSnapshot> NewestSnapshot() { return optimizer().Newest(); }
  // Takes over the fits that the background thread has finished and that are still wanted. True
  // when there was one.
  bool CollectFits();
  // Back to the closed forms, as before any refit. Not an edit.
  void DropFits();

  // The coefficients of the current state, [N, K, 3]: the original's, then each visible region's
  // fit, or where that is out of date its closed form. With no visible region the original's bits.
  FloatArray CurrentSh() const;
  // The last refit's summaries: counts summed over the visible regions.
  RefitSummary Summary() const;

  // The effect of a region's edit between two sets of coefficients, [N, K, 3] each, against its
  // targets on the training and the held-out views. Of each kind at most `most_views` are used,
  // spread evenly (0: all), and every `row_step`-th row of their pixels, see EvaluateEdit().
  QualityReport Evaluate(RegionId id, std::span<const float> sh_before,
                         std::span<const float> sh_after, TargetKind target, Monitor& monitor,
                         size_t most_views = 0, int row_step = 1);
  // A picture of one view after the visible regions' edits: every edit painted over it in order.
  // Not clamped.
  Image Edited(const View& view, Image picture) const;

  // A picture of one view before the picture step of a region's edit, and after it, at full
  // strength. The visible regions before it and the earlier steps of its edit are applied to both.
  // Without a picture step, both are after all steps. Not clamped.
  struct PictureStep {
    Image before, with;
  };
  PictureStep PictureStepOf(RegionId id, const View& view, TargetKind target);

 private:
  // A picture of one view after a region's edit, or another in its place.
  void ApplyEdit(const Region& region, const ColorEdit& edit, const View& view,
                 Image& picture) const;
  // Of `views`, at most so many of them (0: all). With the photos of the own views (ViewReducer),
  // where they are the target.
  std::vector<RefitTarget> Targets(const Region& region, const std::vector<const View*>& views,
                                   TargetKind target, Monitor& monitor, size_t most_views = 0,
                                   bool in_background = false);
  // A photo, read already or, if there is no more room for it and `later` allows it, read at every
  // call.
  std::function<std::shared_ptr<const Image>()> Photo(const std::string& view, bool later);
  RefitChainInput ChainInput(const RefitJob& job, Monitor& monitor, bool in_background);

  OpenScene& scene_;
  RegionStore& store_;
  std::map<std::string, std::shared_ptr<const Image>> photos_;  // never changed
  size_t photo_bytes_ = 0;                                      // of them
  // Used by the optimizer's thread alone; kept between jobs, whose views are mostly the same.
  std::shared_ptr<std::unique_ptr<Renderer>> background_renderer_;
  std::unique_ptr<BackgroundOptimizer> optimizer_;  // last: its thread reads the rest
};

}  // namespace retint
