// SPDX-License-Identifier: BSD-3-Clause
// The Gaussians' own depth of a view with its bias taken out, for visibility tests.
#pragma once

#include "render/renderer.h"
#include "scene/image.h"
#include "scene/reconstruction.h"

namespace retint {

// The expected depth where the pixel is opaque enough to show a surface, else 0; its bias corrected
// by the sparse points that `view` observes (null, a free camera: not corrected). Rows outside
// `pixel_rows` (see kernels/backend.h; bit 0 is set) repeat the row above.
DepthMap SurfaceDepth(Renderer& renderer, const PosedCamera& posed, const View* view,
                      const Reconstruction& reconstruction, uint16_t pixel_rows = kAllPixelRows);

// 1/z_true = a (1/z_rendered) + b.
struct DepthBias {
  double a = 1, b = 0;
  int points = 0;  // sparse points behind it; 0: identity
};

// Robust (Cauchy, reweighted least squares on inverse depth) fit to the sparse points that the view
// observes, those within `max_relative` of the map; held near identity by priors and clamped to
// a in [0.8, 1.25], |b z| <= 0.2 at the median depth. Identity with fewer than 10 points.
DepthBias FitDepthBias(const DepthMap& rendered, const PosedCamera& posed, const View& view,
                       const Reconstruction& reconstruction, double max_relative = 0.15);

// In place; pixels that the correction would push to infinity lose their depth.
void CorrectDepth(const DepthBias& bias, DepthMap* depth);

}  // namespace retint
