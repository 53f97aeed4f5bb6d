// SPDX-License-Identifier: BSD-3-Clause
#include "depth/factory.h"

#include "base/error.h"

namespace retint {

std::vector<std::string> DepthMethods() { return {"gaussian", "stereo-hv", "colmap"}; }

std::unique_ptr<DepthEstimator> MakeDepthEstimator(std::string_view method, Renderer& renderer,
                                                   const Workspace* workspace,
                                                   const DepthOptions& options) {
  options.Check();
  if (method == "gaussian") {
    return std::make_unique<GaussianDepthEstimator>(renderer, options.gaussian);
  }
  if (method == "stereo-hv") {
    return std::make_unique<StereoHvEstimator>(renderer, options.stereo_hv);
  }
  if (method == "colmap") {
    CheckOption(workspace != nullptr, "depth method colmap needs a workspace");
    return std::make_unique<ColmapDepthEstimator>(*workspace, options.colmap, &renderer);
  }
  std::string known;
  for (const auto& name : DepthMethods()) known += (known.empty() ? "" : ", ") + name;
  throw OptionError("unknown depth method '" + std::string(method) + "'; known: " + known);
}

}  // namespace retint
