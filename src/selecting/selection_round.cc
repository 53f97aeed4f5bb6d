// SPDX-License-Identifier: BSD-3-Clause
// Rounds of painting: a selection extended and erased from one view after another.
#include <algorithm>
#include <utility>

#include "base/error.h"
#include "opening/photo_paint.h"
#include "scene/image_checks.h"
#include "scene/mask_pixels.h"
#include "selecting/selection_pipeline.h"
#include "selection/evidence.h"
#include "selection/view_depth.h"

namespace retint {
namespace {

// 255 where `mask` is inside and `other` (no pixels: nowhere) is not.
Mask InsideBut(const Mask& mask, const Mask& other) {
  Mask result(mask.width, mask.height);
  for (size_t i = 0; i < mask.data.size(); ++i) {
    const bool in_other = !other.Empty() && IsInside(other.data[i]);
    result.data[i] = IsInside(mask.data[i]) && !in_other ? 255 : 0;
  }
  return result;
}

// The pixels of a view whose surface shows the selected part of `changed`, 255.
Mask ShownIn(Backend& backend, const DepthMap& depth, const PosedCamera& camera,
             const std::vector<PaintedSurface>& changed, double tolerance) {
  const Evidence seen = LookUpPaint(backend, camera, depth, changed, tolerance, 0);
  Mask shown(depth.width, depth.height);
  for (size_t i = 0; i < shown.data.size(); ++i) {
    if (seen.weight.data[i] > 0 && seen.inside.data[i] >= 0.5F) shown.data[i] = 255;
  }
  return shown;
}

void Set(const Mask& where, uint8_t value, Mask* mask) {
  for (size_t i = 0; i < mask->data.size(); ++i) {
    if (IsInside(where.data[i])) mask->data[i] = value;
  }
}

std::string FreeViewName(const Reconstruction& reconstruction,
                         const std::vector<PaintedView>& painted) {
  for (int number = 1;; ++number) {
    const std::string name = "free view " + std::to_string(number);
    const bool used = std::any_of(painted.begin(), painted.end(),
                                  [&](const PaintedView& view) { return view.name == name; });
    if (!used && !reconstruction.FindView(name)) return name;
  }
}

// Points that were sampled in the view `name` go; `sources` stays, so that no index changes.
void DropSource(const std::string& name, SelectionCloud* cloud) {
  const auto found = std::find(cloud->sources.begin(), cloud->sources.end(), name);
  if (found == cloud->sources.end()) return;
  const auto source = static_cast<uint16_t>(found - cloud->sources.begin());
  std::erase_if(cloud->points, [&](const SelectionPoint& p) { return p.source == source; });
}

// The results of earlier paint on the same picture, whole or on the views that show it.
void DropEarlier(const Workspace& workspace, const PaintedView& newest, SelectionSource* source) {
  std::vector<std::string> names = PaintedNames(workspace, newest);
  for (const std::string& name : names) {
    DropSource(name, &source->cloud);
    std::erase_if(source->reports,
                  [&](const PaintedReport& report) { return report.view == name; });
  }
  names.push_back(newest.name);
  std::erase_if(source->painted, [&](const PaintedView& view) {
    return std::find(names.begin(), names.end(), view.name) != names.end();
  });
}

}  // namespace

void SelectionPipeline::CarryChanges(const PaintRound& round, double tolerance,
                                     SelectionSource* source, Monitor& monitor) {
  const Camera& camera = round.view.camera.camera;
  Mask erased = round.before.Empty() ? Mask(camera.width, camera.height)
                                     : InsideBut(round.before, round.view.mask);
  Mask added = InsideBut(round.view.mask, round.before);
  if (source->painted.empty() || !(AnyInside(erased) || AnyInside(added))) return;
  Renderer& renderer = scene_.renderer();
  const Reconstruction& reconstruction = scene_.reconstruction();
  const Workspace& workspace = scene_.workspace();
  renderer.SetSh(scene_.original().sh);
  const auto depth_of = [&](const PaintedView& view) {
    return SurfaceDepth(renderer, view.camera, reconstruction.FindView(view.name), reconstruction);
  };
  const auto on_views = [&](Mask mask) {
    return OnViews(workspace, PaintedView{round.view.name, round.view.camera, std::move(mask)});
  };
  const std::vector<PaintedView> erased_on = on_views(std::move(erased));
  const std::vector<PaintedView> added_on = on_views(std::move(added));
  std::vector<PaintedSurface> erased_in, added_in;
  for (size_t i = 0; i < erased_on.size(); ++i) {
    const PaintedView &gone = erased_on[i], &come = added_on[i];
    erased_in.push_back({gone.name, gone.camera, &gone.mask, depth_of(gone)});
    added_in.push_back({come.name, come.camera, &come.mask, erased_in.back().depth});
    Erase(source->cloud, gone.camera, gone.mask, erased_in.back().depth, tolerance);
  }
  double done = 0;
  for (PaintedView& view : source->painted) {
    monitor.Step("rounds", done++, static_cast<double>(source->painted.size()));
    std::vector<Mask> gone, come;
    for (const PaintedView& on : OnViews(workspace, view)) {
      const DepthMap depth = depth_of(on);
      gone.push_back(ShownIn(renderer.backend(), depth, on.camera, erased_in, tolerance));
      come.push_back(ShownIn(renderer.backend(), depth, on.camera, added_in, tolerance));
    }
    Set(FromViews(workspace, view, std::move(gone)), 0, &view.mask);
    Set(FromViews(workspace, view, std::move(come)), 255, &view.mask);
  }
  monitor.Step("rounds", 1, 1);
}

RegionSelection SelectionPipeline::SelectRound(const RegionSelection* base, PaintRound round,
                                               const SelectOptions& select,
                                               const ProjectorOptions& project, Monitor& monitor) {
  RequireSize("the painted mask", round.view.mask, round.view.camera.camera);
  if (!round.before.Empty()) {
    RequireSize("the mask before painting", round.before, round.view.camera.camera);
  }
  const Reconstruction& reconstruction = scene_.reconstruction();
  RegionSelection result;
  std::vector<PaintedView>& painted = result.source.painted;
  if (base) {
    result.source = base->source;
    if (painted.empty()) {  // masks from files are paint as good as any
      for (const auto& [name, mask] : base->masks) {
        painted.push_back({name, reconstruction.Posed(scene_.workspace().RequireView(name)), mask});
      }
    }
  }
  if (round.view.name.empty()) round.view.name = FreeViewName(reconstruction, painted);
  const auto earlier = std::ranges::find(painted, round.view.name, &PaintedView::name);
  if (round.view.outlined_by.empty() && earlier != painted.end()) {
    round.view.outlined_by = earlier->outlined_by;  // the round changed that outline
  }
  DropEarlier(scene_.workspace(), round.view, &result.source);
  CarryChanges(round, project.visible_tolerance, &result.source, monitor);
  result.source.select = select;
  result.source.select.keep_raw = false;
  result.source.projector = project;
  if (AnyInside(round.view.mask)) {
    SelectionResult selected = Select({round.view}, result.source.select, monitor);
    Append(result.source.cloud, std::move(selected.cloud));
    for (PaintedReport& report : selected.painted) {
      result.source.reports.push_back(std::move(report));
    }
  }
  painted.push_back(std::move(round.view));
  ProjectedMasks projected = Project(result.source, monitor);
  result.masks = std::move(projected.masks);
  result.shares = std::move(projected.shares);
  return result;
}

Mask SelectionPipeline::SeenFrom(const RegionSelection& selection, const PosedCamera& camera) {
  return RenderShares(scene_.renderer(), camera, selection.shares, {}, graph_.get());
}

}  // namespace retint
