// SPDX-License-Identifier: BSD-3-Clause
// Internal to selection: renders the shares of Gaussians as masks.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "kernels/backend.h"
#include "render/renderer.h"
#include "scene/image.h"
#include "scene/reconstruction.h"
#include "selection/gaussian_graph.h"
#include "selection/mask_projector.h"

namespace retint {

// Masks from the shares m, [N] in [0, 1]: step 3 of mask_projector.h. `graph` knows the floaters;
// null: there are none.
class ShareRenderer {
 public:
  // OptionError unless there is one share a Gaussian.
  ShareRenderer(Renderer& renderer, const std::vector<float>& shares,
                const ProjectorOptions& options, const GaussianGraph* graph);

  // Queues the mask of a view, [H, W].
  Buffer<uint8_t> Render(const PosedCamera& view);

 private:
  Renderer& renderer_;
  Backend& backend_;
  Buffer<float> shares_, features_, image_;
  float low_, high_;  // shares at which the mask is 0 and 255
  double scale_, offset_;
};

// Renders masks of `views` to `masks` in groups. The host receives the masks of one group while a
// device draws the next. Calls `step` before each view.
void RenderMasks(Renderer& renderer, const Reconstruction& reconstruction,
                 const std::vector<const View*>& views, const std::vector<float>& shares,
                 const ProjectorOptions& options, const GaussianGraph* graph,
                 const std::function<void()>& step, std::map<std::string, Mask>* masks);

}  // namespace retint
