// SPDX-License-Identifier: BSD-3-Clause
// Depth from a COLMAP dense workspace: the view's own map, and the maps of the images nearest to it
// warped into it, where it has none.
#pragma once

#include <filesystem>
#include <vector>

#include "base/option.h"
#include "depth/depth_estimator.h"
#include "render/renderer.h"
#include "scene/camera.h"

namespace retint {

struct Workspace;

struct ColmapDepthOptions {
  int max_sources = 4;            // nearest images whose maps are warped into the view
  double edge_tolerance = 0.05;   // relative depth step across which a map is not interpolated
  double agree_tolerance = 0.02;  // relative, between maps that see the same pixel
  void Describe(OptionList& list);
  void Check() const;
};

class ColmapDepthEstimator : public DepthEstimator {
 public:
  // Finds the maps, geometric before photometric; they are read when they are needed. `fallback`,
  // when given, fills pixels that no map sees with the Gaussians' depth, and outlives the
  // estimator. InputError when the workspace has no depth map, or has them for distorted cameras.
  explicit ColmapDepthEstimator(const Workspace& workspace, const ColmapDepthOptions& options = {},
                                Renderer* fallback = nullptr);
  // A map may have any resolution: it covers its camera's whole image. InputError for a damaged
  // map, or when no map sees the view.
  DepthEstimate Estimate(const PosedCamera& view, Monitor& monitor) override;

 private:
  struct Source {
    PosedCamera camera;
    std::filesystem::path path;
  };
  // Those that may see `view`, its own first, then by distance and angle; `own` tells whether the
  // first is its own.
  std::vector<const Source*> Rank(const PosedCamera& view, bool* own) const;

  std::vector<Source> sources_;
  std::vector<Eigen::Vector3d> points_;  // world, to scale distances with
  std::filesystem::path folder_;
  double scale_;  // of the maps to the reconstruction's unit
  ColmapDepthOptions options_;
  Renderer* fallback_;
};

// Internal, exposed for tests. The first resamples `map`, seen by `source` (whose whole image it
// covers), into a camera in the same place with the same rotation. Inverse depth is interpolated
// except across edges and holes.
DepthMap ResampleDepth(const DepthMap& map, const Camera& source, const Camera& target,
                       double edge_tolerance);
// `map` warped into `target`. Its pixels are joined into triangles, except across edges, and the
// triangles are rasterized nearest first. Pixels without a triangle are 0.
DepthMap WarpDepth(const DepthMap& map, const PosedCamera& source, const PosedCamera& target,
                   double edge_tolerance);

}  // namespace retint
