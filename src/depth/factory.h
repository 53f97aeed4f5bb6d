// SPDX-License-Identifier: BSD-3-Clause
// Depth estimators by name.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "base/option.h"
#include "depth/colmap_depth.h"
#include "depth/colmap_mvs.h"
#include "depth/depth_estimator.h"
#include "depth/gaussian.h"
#include "depth/stereo_hv.h"

namespace retint {

struct DepthOptions {
  GaussianDepthOptions gaussian;
  StereoHvOptions stereo_hv;
  ColmapDepthOptions colmap;
  ColmapMvsOptions colmap_mvs;
  void Describe(OptionList& list);
  void Check() const;
};

// "gaussian", "stereo-hv", "colmap", "colmap-mvs".
std::vector<std::string> DepthMethods();
// The same with a description of each: "gaussian (the splat's own), stereo-hv (rendered pairs) or
// ...".
std::string DepthMethodsHelp();

// OptionError for an unknown method or bad options. "colmap" needs the workspace (OptionError
// without it, InputError when it has no depth maps), "colmap-mvs" the program. `renderer` outlives
// the estimator.
std::unique_ptr<DepthEstimator> MakeDepthEstimator(std::string_view name, Renderer& renderer,
                                                   const Workspace* workspace = nullptr,
                                                   const DepthOptions& options = {});

}  // namespace retint
