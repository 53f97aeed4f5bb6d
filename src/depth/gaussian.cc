// SPDX-License-Identifier: BSD-3-Clause
#include "depth/gaussian.h"

#include <utility>

#include "base/error.h"

namespace retint {

GaussianDepthEstimator::GaussianDepthEstimator(Renderer& renderer,
                                               const GaussianDepthOptions& options)
    : renderer_(renderer), options_(options) {
  options_.Check();
}

DepthEstimate GaussianDepthEstimator::Estimate(const PosedCamera& view, Monitor& monitor) {
  monitor.Step("depth", 0, 1);
  const bool median = options_.kind == GaussianDepthOptions::Kind::kMedian;
  RenderRequest request;
  request.rgb = false;
  request.alpha = true;
  request.depth_median = median;
  request.depth_expected = !median;
  request.median_threshold = static_cast<float>(options_.tau);
  RenderOutput render = renderer_.Render(view, request);

  DepthEstimate estimate;
  estimate.method = "gaussian";
  estimate.depth = std::move(median ? render.depth_median : render.depth_expected);
  estimate.valid = Mask(estimate.depth.width, estimate.depth.height, 0);
  size_t valid = 0;
  for (size_t i = 0; i < estimate.depth.data.size(); ++i) {
    float& depth = estimate.depth.data[i];
    if (!(depth > 0) || render.alpha.data[i] < options_.min_alpha) {
      depth = 0;
      continue;
    }
    estimate.valid.data[i] = 255;
    ++valid;
  }
  estimate.valid_fraction = double(valid) / double(estimate.depth.NumPixels());
  estimate.reason = median ? "median depth of the Gaussians" : "expected depth of the Gaussians";
  if (valid < estimate.depth.NumPixels()) estimate.reason += ", unknown where they are transparent";
  monitor.Step("depth", 1, 1);
  return estimate;
}

}  // namespace retint
