// SPDX-License-Identifier: BSD-3-Clause
// Depth by COLMAP's own dense stereo, run as a program. Views rendered around the wanted one become
// a dense workspace in a temporary folder. `colmap patch_match_stereo` measures it, and its map is
// read like any other. Schoenberger et al., "Pixelwise View Selection for Unstructured Multi-View
// Stereo", ECCV 2016. Needs a COLMAP that was built with CUDA, and a GPU.
#pragma once

#include <filesystem>
#include <string>

#include "base/option.h"
#include "depth/colmap_depth.h"
#include "depth/depth_estimator.h"
#include "render/renderer.h"

namespace retint {

struct ColmapMvsOptions {
  std::string program = "colmap";  // a path, or a name that is looked up in PATH
  int sources = 8;                 // rendered views around the wanted one, in a ring; 2 to 64
  double angle = 5;  // degrees between their rays and the view's, at the median depth; (0, 45]
  void Describe(OptionList& list);  // apart from the program, which belongs to the machine
  void Check() const;
};

class ColmapMvsEstimator : public DepthEstimator {
 public:
  // `renderer` outlives the estimator; it also fills pixels that COLMAP could not measure.
  // OptionError when there is no such program.
  explicit ColmapMvsEstimator(Renderer& renderer, const ColmapMvsOptions& options = {});
  // Cancelling ends the program. RunError with the last lines that it printed when it fails;
  // a program without CUDA is told as such.
  DepthEstimate Estimate(const PosedCamera& view, Monitor& monitor) override;

 private:
  Renderer& renderer_;
  ColmapMvsOptions options_;
  std::filesystem::path program_;
};

}  // namespace retint
