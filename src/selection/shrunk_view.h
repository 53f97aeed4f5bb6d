// SPDX-License-Identifier: BSD-3-Clause
// Views drawn small, for means over many pixels.
#pragma once

#include <algorithm>
#include <cmath>

#include "scene/camera.h"
#include "scene/camera_projection.h"

namespace retint {

// The same view with at most 100,000 pixels, as many as strokes are solved on
// (mask_tools/scribbles.h).
inline PosedCamera Shrunk(PosedCamera view) {
  constexpr double kMaxPixels = 100'000;
  Camera& camera = view.camera;
  const double shrink =
      std::min(1.0, std::sqrt(kMaxPixels / (double(camera.width) * camera.height)));
  const int width = std::max(1, int(camera.width * shrink));
  const int height = std::max(1, int(camera.height * shrink));
  camera = Resized(camera, width, height);
  return view;
}

}  // namespace retint
