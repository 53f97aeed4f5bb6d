// SPDX-License-Identifier: BSD-3-Clause
// The depth of the Gaussians in a view, without its bias, for visibility tests.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "render/renderer.h"
#include "scene/image.h"
#include "scene/reconstruction.h"

namespace retint {

// The depth of a view, in backend memory: the expected depth, or 0 if the pixel is too transparent
// to show a surface. The view's sparse points correct its bias.
struct ViewSurface {
  std::shared_ptr<const ViewGeometry> geometry;
  Buffer<float> depth;  // [H, W]
};

struct SurfaceRequest {
  PosedCamera posed;
  const View* view = nullptr;  // null: a free camera, without correction
  // The rows that get a depth (kernels/common/types.h; bit 0 must be set).
  uint16_t pixel_rows = kAllPixelRows;
  bool cache = true;  // keep this view's geometry for later
};

struct SurfaceOptions {
  size_t held_bytes = size_t{256} << 20;  // of depths and geometries; one surface always fits
  std::function<void(size_t)> before_each = [](size_t) {};  // of the requests, before it is drawn
  // [N] in backend memory: Gaussians that hide no surface (DepthParams); null: all may hide one.
  const uint8_t* left_out = nullptr;
  // The median along each pixel's ray instead of the expected depth. On a translucent surface it is
  // the surface's depth, but it has steps at the ends of single Gaussians.
  bool median = false;
};

// Calls visit(i, surface) for the requests in their order. Draws a few views ahead. While the host
// fits the corrections of some views at the sparse points, a device draws the next ones. It also
// runs the work that `visit` queued for earlier ones.
void RenderSurfaces(Renderer& renderer, const Reconstruction& reconstruction,
                    const std::vector<SurfaceRequest>& requests, const SurfaceOptions& options,
                    const std::function<void(size_t, ViewSurface)>& visit);

// One surface on the host, the expected depth or the median.
DepthMap SurfaceDepth(Renderer& renderer, const PosedCamera& posed, const View* view,
                      const Reconstruction& reconstruction, bool median = false);

// 1/z_true = a (1/z_rendered) + b.
struct DepthBias {
  double a = 1, b = 0;
  int points = 0;  // sparse points used; 0: identity
};

// Fits the depths `rendered` (0: none) at a view's sparse points to their depths `sparse`: robustly
// (Cauchy, reweighted least squares on inverse depth), with pairs at most `max_relative` apart.
// Priors keep it near identity. Clamped to a in [0.8, 1.25] and |b z| <= 0.2 at the median depth.
// Identity with fewer than 10 points.
DepthBias FitDepthBias(std::span<const double> rendered, std::span<const double> sparse,
                       double max_relative = 0.15);

}  // namespace retint
