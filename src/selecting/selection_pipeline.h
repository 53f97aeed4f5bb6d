// SPDX-License-Identifier: BSD-3-Clause
// From painted pixels to masks on every view: depth, cloud, registration, projection; and rounds of
// painting that extend and erase a selection.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "depth/depth_estimator.h"
#include "opening/open_scene.h"
#include "selecting/region_selection.h"
#include "selecting/select_options.h"
#include "selection/mask_projector.h"
#include "selection/selection_cloud.h"

namespace retint {

// Of scenes with more Gaussians a graph of everything takes seconds and gigabytes, most of them for
// nothing: Completion::kNear then makes one of the selection's Surroundings().
inline constexpr size_t kGraphOfWholeScene = 1'000'000;

// The results of Select() from the painted views, stage by stage.
struct SelectionResult {
  std::vector<DepthEstimate> depths;  // one a painted view, measured about its paint
  SelectionCloud cloud_raw;           // every sampled pixel, unfiltered and unregistered
  SelectionCloud cloud;
  std::vector<PaintedReport> painted;
};

// Whether `decided`, a view's mask with its undecided pixels decided by the scene, may replace the
// view's `own` mask: its area must be 50 % to 125 % of that. A short stroke on a part of a thing
// leaves so much undecided that the scene may select another thing than the outline that the user
// saw.
bool MayStandFor(const Mask& own, const Mask& decided);

struct PaintedPart;  // of it, one painted view's

// Its stages render with the original coefficients and leave those in the scene's renderer. The
// painted picture may be a distorted photo (opening/photo_paint.h): stages then work on the views
// that show it, and return results for these.
class SelectionPipeline {
 public:
  explicit SelectionPipeline(OpenScene& scene) : scene_(scene) {}

  OpenScene& scene() { return scene_; }

  // A workspace view and the mask painted on it. InputError when there is no such view, the mask is
  // of another size, or no pixel is set.
  PaintedView Paint(std::string_view view_name, Mask mask) const;

  DepthEstimate EstimateDepth(const PosedCamera& view, const SelectOptions& options,
                              Monitor& monitor);
  // Depth, cloud and registration of every painted view; the points of all are one cloud. Of a
  // photo that takes several views, those in which no painted pixel has a depth give no points.
  // NoDepthError where a view, or all that is painted of such a photo, has none.
  SelectionResult Select(const std::vector<PaintedView>& painted, const SelectOptions& options,
                         Monitor& monitor);
  // Masks of the `wanted` views, where it is empty of every view.
  ProjectedMasks Project(const SelectionCloud& cloud, const std::vector<PaintedView>& painted,
                         const ProjectorOptions& options, Monitor& monitor,
                         const std::vector<const View*>& wanted = {});
  // The same for a selection that keeps its recipe. Select() sets the cloud and the reports of
  // `source`; the rest of its results is left to the caller. Project() needs the cloud.
  SelectionResult Select(SelectionSource& source, Monitor& monitor);
  ProjectedMasks Project(const SelectionSource& source, Monitor& monitor);
  // Masks of the `wanted` views, by name, from painted views with undecided pixels (`seen` is 0;
  // the mask does not count there). The Gaussians decide about them, because other views show them
  // from other sides. InputError as Select() and Project().
  std::map<std::string, Mask> Decide(std::vector<PaintedView> painted,
                                     const std::vector<const View*>& wanted, Monitor& monitor);

  // A region's selection after one more round of painting; `base` is the selection so far, null in
  // the first round. If rounds disagree, the newest holds: its removed or added pixels are removed
  // from or added to the paint of the rounds before, on the surfaces that both see. A view painted
  // again replaces its earlier paint. A view of no name is a free camera and is given one.
  // InputError when nothing is left selected.
  RegionSelection SelectRound(const RegionSelection* base, PaintRound round,
                              const SelectOptions& select, const ProjectorOptions& project,
                              Monitor& monitor);
  // The selection as a soft mask of any camera.
  Mask SeenFrom(const RegionSelection& selection, const PosedCamera& camera);

 private:
  DepthEstimate EstimatePart(const PosedCamera& view, const GridRect& part,
                             const SelectOptions& options, Monitor& monitor);
  PaintedPart SelectOne(const PaintedView& view, const SelectOptions& options, Monitor& monitor);
  // The filtered cloud of one painted view; where wanted, its raw points are added to `all_raw`.
  SelectionCloud Unproject(const PaintedView& view, const DepthEstimate& depth,
                           const SelectOptions& options, SelectionCloud* all_raw,
                           PaintedReport* report, Monitor& monitor);
  void RegisterCloud(const PaintedView& view, const DepthEstimate& depth,
                     const SelectOptions& options, SelectionCloud* cloud, PaintedReport* report,
                     Monitor& monitor);
  // Carries the erased and added pixels of a round over to the paint and the cloud of the rounds
  // before.
  void CarryChanges(const PaintRound& round, double tolerance, SelectionSource* source,
                    Monitor& monitor);

  // The graph that a completion of `cloud` works on, kept for the next ones.
  const GaussianGraph& GraphFor(const SelectionCloud& cloud, Completion completion,
                                Monitor& monitor);

  OpenScene& scene_;
  std::unique_ptr<GaussianGraph> graph_;  // of the original scene or of a part of it
};

}  // namespace retint
