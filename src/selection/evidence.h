// SPDX-License-Identifier: BSD-3-Clause
// The evidence for each pixel of a view from the paint on others: whether it shows the selection,
// and how surely.
#pragma once

#include <string>
#include <vector>

#include "render/renderer.h"
#include "scene/camera.h"
#include "scene/image.h"

namespace retint {

// A painted view with the depth that it sees.
struct PaintedSurface {
  std::string name;
  PosedCamera camera;
  const Mask* mask = nullptr;
  DepthMap depth;
};

struct Evidence {
  ScalarImage inside;  // M in [0, 1]
  ScalarImage weight;  // K >= 0
};

// The painted view `painted` for MaskOps::Evidence, which looks up pixels of `view` in it. Depth
// and mask are in backend memory.
PaintedImage LookedUpFrom(const PosedCamera& view, const PosedCamera& painted, const float* depth,
                          const uint8_t* mask);

// Unprojects each pixel by its `depth` and looks the point up in the painted views. Views that see
// it agree within `tolerance` on its depth. The pixel gets their mean paint and the weight 1. If no
// view sees it, the weight is `unknown_weight`.
Evidence LookUpPaint(Backend& backend, const PosedCamera& view, const DepthMap& depth,
                     const std::vector<PaintedSurface>& painted, double tolerance,
                     double unknown_weight);

}  // namespace retint
