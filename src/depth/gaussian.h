// SPDX-License-Identifier: BSD-3-Clause
// The Gaussians' own depth: cheap, complete, and wrong on textureless surfaces and thin parts. The
// rough depth that stereo starts from and falls back to.
#pragma once

#include "base/option.h"
#include "depth/depth_estimator.h"
#include "render/renderer.h"

namespace retint {

struct GaussianDepthOptions {
  enum class Kind {
    kMedian,    // z of the Gaussian at which transmittance falls below tau
    kExpected,  // W z / W 1: smoother; between the surfaces at depth edges
  };
  Kind kind = Kind::kMedian;
  double tau = 0.5;        // transmittance at the median, in (0, 1)
  double min_alpha = 0.5;  // pixels less opaque than this have no depth; in (0, 1)
  void Describe(OptionList& list);
  void Check() const;
};

class GaussianDepthEstimator : public DepthEstimator {
 public:
  // Keeps the reference: `renderer` outlives the estimator.
  explicit GaussianDepthEstimator(Renderer& renderer, const GaussianDepthOptions& options = {});
  DepthEstimate Estimate(const PosedCamera& view, Monitor& monitor) override;

 private:
  Renderer& renderer_;
  GaussianDepthOptions options_;
};

}  // namespace retint
