// SPDX-License-Identifier: BSD-3-Clause
// Shares of Gaussians as masks. Internal to selection.
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

// Of the shares m, [N] in [0, 1], as masks (step 3 of mask_projector.h).
// `graph` knows the floaters; null: there are none.
class ShareRenderer {
 public:
  // OptionError unless there is one share a Gaussian.
  ShareRenderer(Renderer& renderer, const std::vector<float>& shares,
                const ProjectorOptions& options, const GaussianGraph* graph);

  // Queues a view's mask, [H, W].
  Buffer<uint8_t> Render(const PosedCamera& view);

 private:
  Renderer& renderer_;
  Backend& backend_;
  Buffer<float> shares_, features_, image_;
  float low_, high_;  // shares of which the mask is 0 and 255
  double scale_, offset_;
};

// Masks of `views` to `masks`, a group at a time: the host takes the masks of one, and the memory
// for them, while a device draws the next. Calls `step` before each view.
void RenderMasks(Renderer& renderer, const Reconstruction& reconstruction,
                 const std::vector<const View*>& views, const std::vector<float>& shares,
                 const ProjectorOptions& options, const GaussianGraph* graph,
                 const std::function<void()>& step, std::map<std::string, Mask>* masks);

}  // namespace retint
