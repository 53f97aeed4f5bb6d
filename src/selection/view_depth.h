// SPDX-License-Identifier: BSD-3-Clause
// The Gaussians' own depth of a view with its bias taken out, for visibility tests.
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

// The depth of a view, in backend memory: the expected depth if the pixel is opaque enough to show
// a surface, else 0; its bias corrected by the sparse points that the view observes.
struct ViewSurface {
  std::shared_ptr<const ViewGeometry> geometry;
  Buffer<float> depth;  // [H, W]
};

struct SurfaceRequest {
  PosedCamera posed;
  const View* view = nullptr;  // null, a free camera: not corrected
  // The rows that have a depth (see kernels/common/types.h; bit 0 is set).
  uint16_t pixel_rows = kAllPixelRows;
  bool cache = true;  // keep this view's geometry for later
};

struct SurfaceOptions {
  size_t held_bytes = size_t{256} << 20;  // depths and geometries; one surface in any case
  std::function<void(size_t)> before_each = [](size_t) {};  // of the requests, before it is drawn
  // [N] backend memory, of the Gaussians that hide no surface (DepthParams); null: all may.
  const uint8_t* left_out = nullptr;
  // The median along each pixel's ray, in place of the expected depth: on a surface that lets much
  // light through, that of the surface, but with steps where single Gaussians end.
  bool median = false;
};

// Calls visit(i, surface) for the requests in their order. Views are drawn a few ahead: while the
// host finds the corrections of some by their samples at the sparse points, a device draws the next
// and runs the work that `visit` queues for those before.
void RenderSurfaces(Renderer& renderer, const Reconstruction& reconstruction,
                    const std::vector<SurfaceRequest>& requests, const SurfaceOptions& options,
                    const std::function<void(size_t, ViewSurface)>& visit);

// One of them on the host, the expected depth or the median.
DepthMap SurfaceDepth(Renderer& renderer, const PosedCamera& posed, const View* view,
                      const Reconstruction& reconstruction, bool median = false);

// 1/z_true = a (1/z_rendered) + b.
struct DepthBias {
  double a = 1, b = 0;
  int points = 0;  // sparse points behind it; 0: identity
};

// Robust (Cauchy, reweighted least squares on inverse depth) fit of the depths `rendered` (0: none)
// at a view's sparse points to theirs, `sparse`: those within `max_relative` of each other. Held
// near identity by priors and clamped to a in [0.8, 1.25], |b z| <= 0.2 at the median depth.
// Identity with fewer than 10 points.
DepthBias FitDepthBias(std::span<const double> rendered, std::span<const double> sparse,
                       double max_relative = 0.15);

}  // namespace retint
