// SPDX-License-Identifier: BSD-3-Clause
// The mask of one picture by the tools that find an outline, as `retint mask` and Python call them.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "base/monitor.h"
#include "network/mask_network.h"
#include "scene/image.h"
#include "selecting/scene_answer.h"
#include "selecting/selection_pipeline.h"
#include "selection/mask_tools/pixel_tools.h"

namespace retint {

struct ViewMaskRequest {
  struct Sphere {
    Eigen::Vector3d center;
    double radius;
  };
  struct Box {
    Eigen::Vector3d min, max;  // along the world's axes
  };
  struct Like {
    int x, y;  // pixels
    double tolerance = WandOptions().color;
  };

  // The tool that selects: one of these; without any, everything is selected. Masks are of the
  // picture's size.
  Mask mask;
  Mask inside, outside;  // strokes; `outside` may be empty
  // Its outline is completed as strokes are; with it, both kinds of strokes may be empty.
  std::shared_ptr<const MaskNetwork> network;
  ObjectPrompt prompt;  // for the network
  std::optional<WandOptions> wand;
  std::vector<Eigen::Vector2i> scissors;  // pixels
  // The limits of it.
  std::optional<Sphere> sphere;
  std::optional<Box> box;
  std::optional<Like> like;

  // Strokes: pixels that this view alone does not decide stay as its colors and edges have them.
  // Otherwise the Gaussians decide, which all views show (AskScene()).
  bool this_view_alone = false;
  int snap_edge = 0;   // pixels, 0: the border stays; see RefineEdge()
  bool photo = false;  // edges and colors are read in the photo, not in the render

  // OptionError when more than one thing selects, nothing selects or limits, or there are strokes
  // outside and neither strokes inside nor a network.
  void Check() const;
};

// The layers of a picture for the tools, in its own pixels: rendered with the coefficients `sh` [N,
// K, 3], or its photo; and the surfaces' depth.
ViewLayers LayersOf(OpenScene& scene, const UserPicture& picture, std::span<const float> sh,
                    bool photo = false);

// The picture's mask, soft; 128 and above is inside. `asked`, if not null, gets the scene's answer
// for strokes that left pixels undecided. If the answer may replace the outline, it is the mask.
// InputError if no pixel is selected; else as the tools (selection/mask_tools).
Mask MakeViewMask(SelectionPipeline& selection, const UserPicture& picture,
                  const ViewMaskRequest& request, Monitor& monitor,
                  std::optional<SceneAnswer>* asked = nullptr);

}  // namespace retint
