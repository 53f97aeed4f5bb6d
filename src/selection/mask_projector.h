// SPDX-License-Identifier: BSD-3-Clause
// The selection as a soft mask on every training view.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "base/monitor.h"
#include "render/renderer.h"
#include "scene/image.h"
#include "scene/reconstruction.h"
#include "selection/selection_cloud.h"

namespace retint {

enum class ProjectorKind { kQuads, kSurfels, kGaussians };

struct ProjectorOptions {
  ProjectorKind kind = ProjectorKind::kGaussians;
  double quad_pixels = 3;         // side of a screen-space quad
  double surfel_scale = 1.5;      // disc radius in footprints
  int close_radius = 2;           // pixels, morphological close after splatting
  double depth_tolerance = 0.02;  // relative; points further behind the view's depth are hidden
  double share_threshold = 0.3;   // gaussians: rendered share above which a pixel is inside
  // How the evidence is weighed; being tuned.
  double unknown_weight = 0.2;
  double painted_weight = 1;
  int evidence_mode = 2;  // 0 surfels, 1 backward, 2 both
  int median = 0;
  int iterations = 0;
  double visible_tolerance = 0.03;
  void Check() const;
};

// A painted view: its pixels are known, so its mask is evidence as it stands.
struct PaintedView {
  std::string name;
  PosedCamera camera;
  Mask mask;
};

struct ProjectedMasks {
  std::map<std::string, Mask> masks;  // by image name, soft
  std::vector<float> shares;          // [N] m_g in [0, 1]; empty unless kind is kGaussians
  double mean_coverage = 0;           // mean over views of the masked fraction
};

// Projects `cloud` to every view of `views`. The depth test compares with each view's own rendered
// depth, its bias corrected by the sparse points seen in that view. InputError when no view
// receives a masked pixel.
ProjectedMasks ProjectMasks(const SelectionCloud& cloud, const std::vector<PaintedView>& painted,
                            const Reconstruction& reconstruction,
                            const std::vector<const View*>& views, Renderer& renderer,
                            const ProjectorOptions& options, Monitor& monitor);

}  // namespace retint
