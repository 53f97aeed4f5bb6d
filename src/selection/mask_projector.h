// SPDX-License-Identifier: BSD-3-Clause
// The selection as a soft mask on every training view.
//
// `gaussians`, the default kind, finds the selected Gaussians, then renders them in three
// steps.
//  1. Evidence. Each pixel of each view gets a mask value M and a weight K. In a painted
//     view, M is the paint and K = painted_weight, inside and outside alike. K is 0 in pixels
//     without a surface, and just outside a silhouette, where its fringe still shows.
//     Completion also sets K to 0 between the end of the paint and an edge at most
//     paint_slack away (mask_tools/paint_border.h).
//     In another view, each pixel's surface is looked up in the painted views. They see it if
//     its depth agrees within visible_tolerance, and as well as the scene's depths usually
//     do. Then M is the paint there and K = 1, so a surface beside the paint counts against
//     the selection. If none sees it, M and K are the coverage of the cloud's surfels. If
//     that is 0 too, K = 0 with completion, otherwise M = 0 with a small weight, K =
//     unknown_weight. For scenes with few cameras, completion adds views between them, drawn
//     small.
//  2. Share. m_g = sum_v W_v^T (K M) / sum_v W_v^T K of each Gaussian g, where W_v blends
//     view v. It is the mean of M over all pixels of g, weighted by K and its blending
//     weights. If too little of g was seen, it is completed (selection/completion.h).
//  3. Masks. A painted view's mask is its paint. In other views it follows from W_v m + (1 -
//     W_v 1) b, so all views agree. It is 0.5 (128) at share_threshold t, and 0 and 1 at
//     min(t, 1 - t) / 2 below and above. The background's share b is the lower end. Hence,
//     dark surfaces that were trained on black, often half transparent, are selected down to
//     an opacity of a third. Then lost paint is put back in pixels that show a painted
//     surface, by a lookup with a narrow tolerance.
//     Completion's graph knows floaters (selection/lifted_surfaces.h). They hide no surface
//     from the lookup and take no part in completion. In masks their share is
//     share_threshold, so that the Gaussians behind them decide. docs/benchmarks.md has
//     figures for each part.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "base/monitor.h"
#include "base/option.h"
#include "render/renderer.h"
#include "scene/image.h"
#include "scene/reconstruction.h"
#include "selection/completion.h"
#include "selection/selection_cloud.h"

namespace retint {

enum class ProjectorKind { kQuads, kSurfels, kGaussians };

struct ProjectorOptions {
  ProjectorKind kind = ProjectorKind::kGaussians;
  double quad_pixels = 3;         // relative; points further behind the view's depth are hidden
  double depth_tolerance = 0.02;  // relative; points further behind the view's depth are hidden
  double share_threshold = 0.5;  // gaussians: a pixel is inside if its rendered share is above this
  double painted_weight = 8;     // gaussians: weight of a painted view's pixels in the evidence
  // gaussians: the rule for surfaces that no painted view sees
  Completion completion = Completion::kNear;
  double unknown_weight = 0.1;  // gaussians: their weight against the selection, without completion
  double visible_tolerance = 0.03;  // gaussians: relative, a painted view sees what lies at most
                                    // this close to its depth; less if the scene's depths agree
  // gaussians, with completion: how far paint may miss an edge, as a fraction of the picture's
  // longer side. 0: painted borders are exact
  double paint_slack = 0;
  bool Completes() const {
    return kind == ProjectorKind::kGaussians && completion != Completion::kOff;
  }
  void Describe(OptionList& list);
  void Check() const;
};

// A painted view. Its pixels are known: its mask is used as evidence without a lookup.
struct PaintedView {
  std::string name;
  PosedCamera camera;
  Mask mask;
  Mask seen =
      {};  // 0: the painter saw nothing there, so a missing stroke says nothing; empty: all seen
  std::string outlined_by = {};  // MaskNetwork::Identity() of a network that took part; or empty
};

struct ProjectedMasks {
  std::map<std::string, Mask> masks;  // by image name, soft; 128 and above is inside
  std::vector<float> shares;          // [N] m_g in [0, 1]; empty unless kind is kGaussians
  std::vector<float> confidence;      // [N] in the shares (CompletedShares); empty: not completed
  std::vector<float> visible;         // [N] W^T 1 over the views, pixels; empty: not completed
  double mean_coverage = 0;           // mean over views of the masked fraction
};

// Step 3 for any camera: a soft mask from `shares`, [N], 128 at share_threshold. Floaters of
// `graph` do not vote; null: there are none.
Mask RenderShares(Renderer& renderer, const PosedCamera& view, const std::vector<float>& shares,
                  const ProjectorOptions& options, const GaussianGraph* graph = nullptr);

// Projects `cloud` to every view of `views`. The depth test uses each view's own rendered
// depth, with its bias corrected by the view's sparse points. `painted` may be empty (a cloud
// only): then all pixels outside the surfels count as outside. Quads and surfels do not use
// `painted`. Completion needs `graph`, of the renderer's model, and renders the model's
// colors to find edges beside the paint; null: no completion. `wanted`: the views that get
// masks; empty: all. `added`: more views as evidence for a completion
// (selection/views_between.h), without masks. Memory holds the masks and a few images,
// whatever the number of views. InputError if a mask has another size than its view, if the
// cloud is empty, if all wanted masks are empty, or if no painted part is selected. Cancelled
// between views.
ProjectedMasks ProjectMasks(const SelectionCloud& cloud, const std::vector<PaintedView>& painted,
                            const Reconstruction& reconstruction,
                            const std::vector<const View*>& views, Renderer& renderer,
                            const ProjectorOptions& options, Monitor& monitor,
                            const GaussianGraph* graph = nullptr,
                            const std::vector<const View*>& wanted = {},
                            const std::vector<PosedCamera>& added = {});

}  // namespace retint
