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

// What a view shows, in backend memory: the expected depth where the pixel is opaque enough to show
// a surface, else 0; its bias corrected by the sparse points that the view observes.
struct ViewSurface {
  std::shared_ptr<const ViewGeometry> geometry;
  Buffer<float> depth;  // [H, W]
};

struct SurfaceRequest {
  PosedCamera posed;
  const View* view = nullptr;  // null, a free camera: not corrected
};

// The surfaces of many views, a batch at a time: the depths of a batch are queued, the host waits
// once for their samples at the sparse points, and their corrections are queued. Rows outside
// `pixel_rows` (see kernels/common/types.h; bit 0 is set) repeat the row above.
class SurfaceRenderer {
 public:
  SurfaceRenderer(Renderer& renderer, const Reconstruction& reconstruction,
                  std::vector<SurfaceRequest> requests, uint16_t pixel_rows = kAllPixelRows);

  // The next surfaces, in the order of the requests: as many as fit a few hundred MB, at least one;
  // none when all were returned. `before_each` is called before each of them.
  std::vector<ViewSurface> Next(const std::function<void()>& before_each = [] {});

 private:
  void Correct(size_t first, std::vector<ViewSurface>* surfaces);

  Renderer& renderer_;
  std::vector<SurfaceRequest> requests_;
  uint16_t pixel_rows_;
  size_t next_ = 0;
  std::vector<size_t> sparse_begin_;  // [requests + 1] into what follows
  std::vector<double> sparse_;        // depth of each sparse point in its view
  Buffer<double> pixels_, samples_;   // [sparse, 2], [sparse]
};

// One of them, on the host.
DepthMap SurfaceDepth(Renderer& renderer, const PosedCamera& posed, const View* view,
                      const Reconstruction& reconstruction);

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
