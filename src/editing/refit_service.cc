// SPDX-License-Identifier: BSD-3-Clause
#include "editing/refit_service.h"

#include <algorithm>
#include <utility>

#include "base/error.h"
#include "editing/compare_pictures.h"
#include "editing/edited_photo.h"
#include "recolor/paint_carrier.h"

namespace retint {

std::function<std::shared_ptr<const Image>()> RefitService::Photo(const std::string& name,
                                                                  bool later) {
  const View& view = scene_.workspace().RequireView(name);
  auto found = photos_.find(name);
  if (found == photos_.end()) {
    const Camera& camera = scene_.reconstruction().Posed(view).camera;
    const size_t bytes =
        static_cast<size_t>(camera.width) * static_cast<size_t>(camera.height) * 3 * sizeof(float);
    if (later && photo_bytes_ + bytes > scene_.options().photo_bytes) {
      return [this, &view] { return std::make_shared<const Image>(scene_.Picture(view)); };
    }
    found = photos_.emplace(name, std::make_shared<const Image>(scene_.Picture(view))).first;
    photo_bytes_ += bytes;
  }
  return [photo = found->second] { return photo; };
}

std::vector<RefitTarget> RefitService::Targets(const Region& region,
                                               const std::vector<const View*>& views,
                                               TargetKind target, Monitor& monitor,
                                               size_t most_views, bool in_background) {
  // A view without a photo is rendered in its place, with the original colors: of several regions
  // and on another thread, those that the renderer must show meanwhile are others.
  const bool later = !in_background && store_.regions().regions.size() == 1;
  std::vector<RefitTarget> targets =
      RenderTargets(scene_.reconstruction(), region.selection->masks, views);
  if (most_views > 0 && targets.size() > most_views) {
    std::vector<RefitTarget> some;
    for (size_t i = 0; i < most_views; ++i) {
      some.push_back(targets[i * targets.size() / most_views]);
    }
    targets = std::move(some);
  }
  if (target == TargetKind::kPhoto && !targets.empty()) {
    const ViewReducer shared = ShareTargets(scene_.renderer().backend(), targets);
    for (const size_t i : shared.own()) {
      monitor.Step("load", static_cast<double>(i), static_cast<double>(targets.size()));
      targets[i].photo = Photo(targets[i].name, later);
    }
    monitor.Step("load", 1, 1);
  }
  const ColorEdit edit = region.EffectiveEdit();
  if (!edit.HasPaint()) return targets;
  // One for all targets, which are made one after the other.
  const auto carrier = std::make_shared<PaintCarrier>(edit, LayerCameras(edit, scene_.workspace()),
                                                      scene_.original(), region.paint);
  for (RefitTarget& one : targets) {
    one.edited = [carrier, camera = one.camera, mask = one.mask, photo = one.photo](
                     Renderer& renderer, Mask* leaves) {
      return carrier->Target(renderer, camera, *mask, photo ? photo().get() : nullptr, leaves);
    };
  }
  return targets;
}

RefitChainInput RefitService::ChainInput(const RefitJob& job, Monitor& monitor,
                                         bool in_background) {
  job.Check();
  RefitChainInput input;
  input.original = &scene_.original();
  input.state = store_.regions();
  input.job = job;
  for (const Region& region : input.state.regions) {
    input.targets.push_back(Targets(region, scene_.train_views(), job.target, monitor,
                                    /*most_views=*/0, in_background));
  }
  return input;
}

void RefitService::Refit(const RefitJob& job, Monitor& monitor) {
  const StageClock::Lap lap(scene_.clock(), "refit");
  RefitChain chain(ChainInput(job, monitor, /*in_background=*/false), scene_.renderer());
  while (chain.Step(monitor)) {
  }
  store_.SetJob(job);
  for (const auto& [id, fit] : chain.fits()) store_.history().SetFit(id, fit);
}

BackgroundOptimizer& RefitService::optimizer() {
  if (!optimizer_) optimizer_ = std::make_unique<BackgroundOptimizer>();
  return *optimizer_;
}

uint64_t RefitService::Start(const RefitJob& job, Monitor& monitor) {
  if (!background_renderer_) background_renderer_ = std::make_shared<std::unique_ptr<Renderer>>();
  auto input = std::make_shared<RefitChainInput>(ChainInput(job, monitor, /*in_background=*/true));
  store_.SetJob(job);
  return optimizer().Start([input, scene = &scene_, renderer = background_renderer_](
                               Monitor&) -> std::unique_ptr<OptimizerJob> {
    if (!*renderer) *renderer = scene->MakeRenderer();
    return std::make_unique<RefitChain>(*input, **renderer);
  });
}

void RefitService::DropFits() {
  optimizer().Cancel();
  optimizer().Wait();
  optimizer().Forget();
  const RegionSet state = store_.regions();
  for (const Region& region : state.regions) store_.history().SetFit(region.id, nullptr);
}

bool RefitService::CollectFits() {
  const auto newest = optimizer().Newest();
  if (!newest) return false;
  bool any = false;
  const RegionSet& state = store_.regions();
  for (size_t i = 0; i < state.regions.size(); ++i) {
    const Region& region = state.regions[i];
    const auto found = newest->fits.find(region.id);
    if (found == newest->fits.end() || found->second == region.fit) continue;
    if (found->second->key != state.FitKey(i, store_.job())) continue;
    store_.history().SetFit(region.id, found->second);
    any = true;
  }
  return any;
}

FloatArray RefitService::CurrentSh() const {
  return store_.ShAfter(store_.regions(), store_.regions().regions.size());
}

RefitSummary RefitService::Summary() const {
  RefitSummary sum;
  bool first = true;
  for (const Region& region : store_.regions().regions) {
    if (!region.visible || !region.fit) continue;
    const RefitSummary& one = region.fit->summary;
    if (first) {
      sum = one;
    } else {
      sum.iterations += one.iterations;
      sum.active_gaussians += one.active_gaussians;
      sum.changed_gaussians += one.changed_gaussians;
      sum.converged = sum.converged && one.converged;
      sum.losses.insert(sum.losses.end(), one.losses.begin(), one.losses.end());
    }
    first = false;
  }
  return sum;
}

QualityReport RefitService::Evaluate(RegionId id, std::span<const float> sh_before,
                                     std::span<const float> sh_after, TargetKind target,
                                     Monitor& monitor, size_t most_views, int row_step) {
  const Region& region = store_.Require(id);
  const auto targets = [&](const std::vector<const View*>& views) {
    return Targets(region, views, target, monitor, most_views);
  };
  return EvaluateEdit(scene_.renderer(), sh_before, sh_after, targets(scene_.train_views()),
                      targets(scene_.heldout_views()), region.EffectiveEdit(), monitor, row_step);
}

RefitService::PictureStep RefitService::PictureStepOf(RegionId id, const View& view,
                                                      TargetKind target) {
  Image image = target == TargetKind::kPhoto ? scene_.Picture(view)
                                             : scene_.Render(view, scene_.original().sh);
  scene_.renderer().SetSh(scene_.original().sh);  // the pictures that a paint carrier looks at
  const Region& region = store_.Require(id);
  for (const Region& other : store_.regions().regions) {
    if (other.id == id) break;
    if (other.visible) ApplyEdit(other, other.EffectiveEdit(), view, image);
  }
  const auto& steps = region.edit.operations;
  const auto picture =
      std::ranges::find(steps, ColorOperationKind::kPicture, &ColorOperation::kind);
  PictureStep result{image, std::move(image)};
  ApplyEdit(region, {{steps.begin(), picture}, 1}, view, result.before);
  if (picture == steps.end()) {
    result.with = result.before;
    return result;
  }
  ColorEdit with{{steps.begin(), picture + 1}, 1};
  with.operations.back().strength = 1;
  ApplyEdit(region, with, view, result.with);
  return result;
}

Image RefitService::Edited(const View& view, Image image) const {
  for (const Region& region : store_.regions().regions) {
    if (region.visible) ApplyEdit(region, region.EffectiveEdit(), view, image);
  }
  return image;
}

void RefitService::ApplyEdit(const Region& region, const ColorEdit& edit, const View& view,
                             Image& picture) const {
  const auto found = region.selection->masks.find(view.name);
  if (found == region.selection->masks.end()) return;
  retint::ApplyEdit(scene_, region, edit, scene_.reconstruction().Posed(view), found->second,
                    picture);
}

}  // namespace retint
