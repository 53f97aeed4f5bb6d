// SPDX-License-Identifier: BSD-3-Clause
// The selection as a soft mask on every training view.
//
// `gaussians`, the default, asks which Gaussians the selection holds, then renders them:
//  1. Evidence. In every view each pixel gets a mask value M and a weight K.
//     A painted view is known exactly: M is the paint, K = painted_weight, inside and outside
//     alike. K is 0 in pixels that show no surface and along the outside of silhouettes, where the
//     fringe of the surface behind the limb shows. For a completion it is also 0 between the
//     paint's end and an edge at most paint_slack away (mask_tools/paint_border.h). In another view
//     the surface in the pixel is looked up in the painted views. If one of them sees it (same
//     depth within visible_tolerance, and within the usual agreement of the scene's depths), M is
//     the paint there and K = 1. So a surface that was seen outside the paint counts against. If
//     none does, M and K are the coverage of the cloud's surfels. If neither speaks, nothing is
//     known: K = 0, or without completion M = 0 with the small weight K = unknown_weight. Views
//     that no camera took are looked at in the same way, drawn small, for a completion of scenes
//     with few cameras.
//  2. Share. m_g = sum_v W_v^T (K M) / sum_v W_v^T K of each Gaussian g, where W_v blends view v:
//     the mean of M over all pixels of g, weighted by K and its blending weights. If too little of
//     it was seen, it is completed (selection/completion.h).
//  3. Masks. A painted view's mask is its paint. In other views the shares decide: W_v m +
//     (1 - W_v 1) b, view-consistent by construction. It is 0.5 (128) at share_threshold, and 0 and
//     1 at half of it away on either side. Then paint that they lost is put back: pixels that
//     show a painted surface, by the look-up with a narrow tolerance. Light that passes all
//     Gaussians counts as b, of which a mask is just 0. Dark surfaces that were trained on black
//     are often half transparent. They are selected down to an opacity of a third if all that they
//     show is selected. Floaters (selection/lifted_surfaces.h), which only a completion's graph
//     knows, hide no surface from the look-up, are no part of the completion, and have no say in
//     masks: there their share is share_threshold, so that those behind them decide.
//     docs/benchmarks.md has figures for each part.
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
  double quad_pixels = 3;         // side of a screen-space quad
  double depth_tolerance = 0.02;  // relative; points further behind the view's depth are hidden
  double share_threshold = 0.5;   // gaussians: rendered share above which a pixel is inside
  double painted_weight = 8;      // gaussians: of a painted view's pixels as evidence
  // gaussians: the rule for surfaces that no painted view sees
  Completion completion = Completion::kNear;
  double unknown_weight = 0.1;  // gaussians: against those surfaces, where nothing completes them
  double visible_tolerance = 0.03;  // gaussians: relative, a painted view sees what lies at most
                                    // this close to its depth; less if the scene's depths agree
  // gaussians, completed: share of the picture's longer side by which paint may miss an edge; 0:
  // the painted border is meant
  double paint_slack = 0;
  bool Completes() const {
    return kind == ProjectorKind::kGaussians && completion != Completion::kOff;
  }
  void Describe(OptionList& list);
  void Check() const;
};

// A painted view: its pixels are known, so its mask is evidence as it stands.
struct PaintedView {
  std::string name;
  PosedCamera camera;
  Mask mask;
  Mask seen =
      {};  // 0 where the painter saw nothing, so that no paint says nothing; empty: all seen
};

struct ProjectedMasks {
  std::map<std::string, Mask> masks;  // by image name, soft, 128 and above is inside
  std::vector<float> shares;          // [N] m_g in [0, 1]; empty unless kind is kGaussians
  std::vector<float> confidence;      // [N] in the shares (CompletedShares); empty: not completed
  std::vector<float> visible;         // [N] W^T 1 over the views, pixels; empty: not completed
  double mean_coverage = 0;           // mean over views of the masked fraction
};

// Step 3 with `shares`, [N], as a soft mask of any camera: 128 where it reaches share_threshold.
// Gaussians that float by `graph` take no part; null: none floats.
Mask RenderShares(Renderer& renderer, const PosedCamera& view, const std::vector<float>& shares,
                  const ProjectorOptions& options, const GaussianGraph* graph = nullptr);

// Projects `cloud` to every view of `views`. The depth test compares with each view's own rendered
// depth, its bias corrected by the sparse points seen in that view. `painted` may be empty (a cloud
// alone): then every pixel that no surfel covers counts as outside; quads and surfels do not use
// it. `graph` of the renderer's model serves the completion, and so do the renderer's colors, which
// show edges beside the paint; null: there is none. Where `wanted` is
// not empty, only these of `views` are given their masks. `added` are more views that a completion
// takes evidence from (selection/views_between.h); they are given none. Memory is bounded by the
// masks and a few images, whatever the number of views. InputError for a mask that is not of its
// view's size, an empty cloud, or when no mask that is wanted receives a pixel, or nothing of
// what was painted is selected; Cancelled between views.
ProjectedMasks ProjectMasks(const SelectionCloud& cloud, const std::vector<PaintedView>& painted,
                            const Reconstruction& reconstruction,
                            const std::vector<const View*>& views, Renderer& renderer,
                            const ProjectorOptions& options, Monitor& monitor,
                            const GaussianGraph* graph = nullptr,
                            const std::vector<const View*>& wanted = {},
                            const std::vector<PosedCamera>& added = {});

}  // namespace retint
