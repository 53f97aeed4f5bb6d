// SPDX-License-Identifier: BSD-3-Clause
// Rounds of painting: a selection extended and erased from one view after another.
#include <algorithm>
#include <utility>

#include "base/error.h"
#include "scene/image_checks.h"
#include "selection/evidence.h"
#include "selection/view_depth.h"
#include "session/selection_pipeline.h"

namespace retint {
namespace {

constexpr uint8_t kInside = 128;

bool AnyInside(const Mask& mask) {
  return std::any_of(mask.data.begin(), mask.data.end(), [](uint8_t v) { return v >= kInside; });
}

// 255 where `mask` is inside and `other` (no pixels: nowhere) is not.
Mask InsideBut(const Mask& mask, const Mask& other) {
  Mask result(mask.width, mask.height);
  for (size_t i = 0; i < mask.data.size(); ++i) {
    const bool in_other = !other.Empty() && other.data[i] >= kInside;
    result.data[i] = mask.data[i] >= kInside && !in_other ? 255 : 0;
  }
  return result;
}

// Sets the pixels of `mask` to `value` where the surface in them shows `change` in `changed`.
void CarryOver(Backend& backend, const DepthMap& depth, const PosedCamera& camera,
               const PaintedSurface& changed, double tolerance, uint8_t value, Mask* mask) {
  const Evidence seen = LookUpPaint(backend, camera, depth, {changed}, tolerance, 0);
  for (size_t i = 0; i < mask->data.size(); ++i) {
    if (seen.weight.data[i] > 0 && seen.inside.data[i] >= 0.5F) mask->data[i] = value;
  }
}

// What is undecided of the view's mask says nothing: neither inside nor outside.
void LeaveOpen(const Mask& undecided, PaintedView* view) {
  if (view->seen.Empty()) view->seen = Mask(view->mask.width, view->mask.height, 255);
  for (size_t i = 0; i < undecided.data.size(); ++i) {
    if (undecided.data[i] > 0) view->seen.data[i] = view->mask.data[i] = 0;
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

}  // namespace

void SelectionPipeline::CarryChanges(const PaintRound& round, double tolerance,
                                     SelectionSource* source, Monitor& monitor) {
  const Camera& camera = round.view.camera.camera;
  Mask erased = round.before.Empty() ? Mask(camera.width, camera.height)
                                     : InsideBut(round.before, round.view.mask);
  Mask added = InsideBut(round.view.mask, round.before);
  for (size_t i = 0; i < round.undecided.data.size(); ++i) {
    if (round.undecided.data[i] > 0) erased.data[i] = added.data[i] = 0;
  }
  if (source->painted.empty() || !(AnyInside(erased) || AnyInside(added))) return;
  Renderer& renderer = scene_.renderer();
  const Reconstruction& reconstruction = scene_.reconstruction();
  renderer.SetSh(scene_.original().sh);
  const auto depth_of = [&](const PaintedView& view) {
    return SurfaceDepth(renderer, view.camera, reconstruction.FindView(view.name), reconstruction);
  };
  PaintedSurface changed{round.view.name, round.view.camera, &erased, depth_of(round.view)};
  Erase(source->cloud, round.view.camera, erased, changed.depth, tolerance);
  double done = 0;
  for (PaintedView& view : source->painted) {
    monitor.Step("rounds", done++, static_cast<double>(source->painted.size()));
    const DepthMap depth = depth_of(view);
    changed.mask = &erased;
    CarryOver(renderer.backend(), depth, view.camera, changed, tolerance, 0, &view.mask);
    changed.mask = &added;
    CarryOver(renderer.backend(), depth, view.camera, changed, tolerance, 255, &view.mask);
  }
}

RegionSelection SelectionPipeline::SelectRound(const RegionSelection* base, PaintRound round,
                                               const SelectOptions& select,
                                               const ProjectorOptions& project, Monitor& monitor) {
  RequireSize("the painted mask", round.view.mask, round.view.camera.camera);
  if (!round.before.Empty()) {
    RequireSize("the mask before painting", round.before, round.view.camera.camera);
  }
  if (!round.undecided.Empty()) {
    RequireSize("what is undecided of a mask", round.undecided, round.view.camera.camera);
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
  const std::string& name = round.view.name;
  std::erase_if(painted, [&](const PaintedView& view) { return view.name == name; });
  DropSource(name, &result.source.cloud);
  std::erase_if(result.source.reports,
                [&](const PaintedReport& report) { return report.view == name; });
  CarryChanges(round, project.visible_tolerance, &result.source, monitor);
  const bool open = AnySet(round.undecided);
  const Mask drawn = round.view.mask, seen = round.view.seen;
  if (open) LeaveOpen(round.undecided, &round.view);

  if (AnyInside(round.view.mask)) {
    SelectOptions options = select;
    options.keep_raw = false;
    SelectionResult selected = Select({round.view}, options, monitor);
    Append(result.source.cloud, selected.cloud);
    for (PaintedReport& report : selected.painted) {
      result.source.reports.push_back(std::move(report));
    }
  }
  painted.push_back(std::move(round.view));
  ProjectedMasks projected = Project(result.source.cloud, painted, project, monitor);
  result.masks = std::move(projected.masks);
  result.shares = std::move(projected.shares);
  if (open) {
    // Rounds to come take for paint what was decided.
    PaintedView& view = painted.back();
    const Mask decided = result.shares.empty()
                             ? drawn
                             : RenderShares(scene_.renderer(), view.camera, result.shares, project);
    for (size_t i = 0; i < decided.data.size(); ++i) {
      if (round.undecided.data[i] > 0) view.mask.data[i] = decided.data[i];
    }
    view.seen = seen;
  }
  return result;
}

Mask SelectionPipeline::SeenFrom(const RegionSelection& selection, const PosedCamera& camera) {
  return RenderShares(scene_.renderer(), camera, selection.shares, {});
}

}  // namespace retint
