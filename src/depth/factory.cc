// SPDX-License-Identifier: BSD-3-Clause
#include "depth/factory.h"

#include "base/error.h"

namespace retint {
namespace {

using Estimator = std::unique_ptr<DepthEstimator>;

// A depth method: this entry, its options in DepthOptions, and its own two files.
struct Method {
  const char* name;
  const char* help;
  Estimator (*make)(Renderer& renderer, const Workspace* workspace, const DepthOptions& options);
};

const Method kMethods[] = {
    {"gaussian", "the splat's own",
     [](Renderer& renderer, const Workspace*, const DepthOptions& options) -> Estimator {
       return std::make_unique<GaussianDepthEstimator>(renderer, options.gaussian);
     }},
    {"stereo-hv", "rendered pairs",
     [](Renderer& renderer, const Workspace*, const DepthOptions& options) -> Estimator {
       return std::make_unique<StereoHvEstimator>(renderer, options.stereo_hv);
     }},
    {"colmap", "the workspace's dense maps",
     [](Renderer& renderer, const Workspace* workspace, const DepthOptions& options) -> Estimator {
       CheckOption(workspace != nullptr, "depth method colmap needs a workspace");
       return std::make_unique<ColmapDepthEstimator>(*workspace, options.colmap, &renderer);
     }},
    {"colmap-mvs", "COLMAP's own stereo on rendered views",
     [](Renderer& renderer, const Workspace*, const DepthOptions& options) -> Estimator {
       return std::make_unique<ColmapMvsEstimator>(renderer, options.colmap_mvs);
     }},
};

}  // namespace

void DepthOptions::Describe(OptionList& list) {
  DescribePart(gaussian, "gaussian", list);
  DescribePart(stereo_hv, "stereo-hv", list);
  DescribePart(colmap, "colmap", list);
  DescribePart(colmap_mvs, "colmap-mvs", list);
}

void DepthOptions::Check() const {
  gaussian.Check();
  stereo_hv.Check();
  colmap.Check();
  colmap_mvs.Check();
}

std::vector<std::string> DepthMethods() {
  std::vector<std::string> names;
  for (const Method& method : kMethods) names.emplace_back(method.name);
  return names;
}

std::string DepthMethodsHelp() {
  std::string text;
  for (const Method& method : kMethods) {
    if (!text.empty()) text += &method == std::end(kMethods) - 1 ? " or " : ", ";
    text += std::string(method.name) + " (" + method.help + ")";
  }
  return text;
}

std::unique_ptr<DepthEstimator> MakeDepthEstimator(std::string_view name, Renderer& renderer,
                                                   const Workspace* workspace,
                                                   const DepthOptions& options) {
  options.Check();
  std::string known;
  for (const Method& method : kMethods) {
    if (method.name == name) return method.make(renderer, workspace, options);
    known += (known.empty() ? "" : ", ") + std::string(method.name);
  }
  throw OptionError("unknown depth method '" + std::string(name) + "'; known: " + known);
}

}  // namespace retint
