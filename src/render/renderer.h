// SPDX-License-Identifier: BSD-3-Clause
// Scene-level face of the kernels: posed cameras in, images out, with a cache of the frozen
// geometry of each view, which several renderers of the same Gaussians may share.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <span>

#include "kernels/backend.h"
#include "render/geometry_cache.h"
#include "scene/camera.h"
#include "scene/gaussian_model.h"
#include "scene/image.h"
#include "scene/splat_traits.h"

namespace retint {

// PINHOLE and SIMPLE_PINHOLE only; InputError with the `colmap image_undistorter` line that helps
// otherwise.
CameraParams ToCameraParams(const PosedCamera& view);

struct RendererOptions {
  // Budget of a geometry cache of its own; see geometry_cache.h.
  size_t cache_bytes = size_t{640} << 20;
  std::array<float, 3> background = {0, 0, 0};  // sRGB; black: none
  // The data that a fit keeps of the views counts against the cache's budget too.
  bool makes_room = false;
  void Check() const;
};

struct RenderRequest {
  bool rgb = true;
  bool depth_median = false;
  bool depth_expected = false;
  bool along_rays = false;  // depth_median: see DepthParams; not with depth_expected
  bool alpha = false;
  float median_threshold = 0.5f;  // transmittance at which depth_median is read, in (0, 1)
  bool cache = true;              // keep this view's geometry for later
  uint16_t pixel_rows =
      kAllPixelRows;  // those wanted; see kernels/common/types.h. Depth and alpha only.
};

struct RenderOutput {
  Image rgb;                // sRGB, not clamped above
  DepthMap depth_median;    // 0 where transmittance stays above median_threshold
  DepthMap depth_expected;  // 0 if no Gaussian is hit
  ScalarImage alpha;
};

// The same left in backend memory, valid in stream order; layers that were not asked for are empty.
struct DeviceRender {
  int width = 0, height = 0;
  Buffer<float> rgb;                                  // [H, W, 3]
  Buffer<float> depth_median, depth_expected, alpha;  // [H, W]
};

// Not thread-safe; one Renderer a thread (they may share the Backend and the cache).
class Renderer {
 public:
  // `cache` is of renderers of the same Gaussians whose backends have the same name and work in
  // host memory. Null: it has one of its own.
  Renderer(std::shared_ptr<Backend> backend, const GaussianModel& model,
           RendererOptions options = {}, std::shared_ptr<GeometryCache> cache = nullptr);
  ~Renderer();

  RenderOutput Render(const PosedCamera& view, const RenderRequest& request = {});
  // The same into arrays that are used again where their size is right, for one frame after the
  // other: fresh memory takes time to be touched.
  void Render(const PosedCamera& view, const RenderRequest& request, RenderOutput* output);
  DeviceRender RenderOnDevice(const PosedCamera& view, const RenderRequest& request = {});

  // The geometry of a view from the cache, prepared when missing.
  std::shared_ptr<const ViewGeometry> Geometry(const PosedCamera& view, bool cache = true);
  // Whether Geometry() would come from the cache.
  bool HasGeometry(const PosedCamera& view) const;

  // Replaces the SH coefficients that later renders use, [N, K, 3]; geometry and cache stay.
  void SetSh(std::span<const float> sh);

  const std::array<float, 3>& background() const { return background_; }  // sRGB
  // Of the Gaussians' blended colors; null if they are sRGB. Renders are sRGB all the same.
  const std::shared_ptr<const LightMap>& light_map() const { return light_map_; }
  // An image [H, W, 3] in backend memory, sRGB as the model's blended colors, or those as sRGB.
  void ToColorsOfModel(int width, int height, float* rgb);
  void ToSrgb(int width, int height, float* rgb);
  Backend& backend() { return *backend_; }
  std::shared_ptr<Backend> shared_backend() { return backend_; }
  Model& model() { return *model_; }
  size_t cached_bytes() const;
  // If options.makes_room: takes bytes off the cache's budget, none so far. Else null.
  std::unique_ptr<GeometryCache::Reservation> Reserve();

 private:
  struct Scratch;
  void Map(const ColorProgram* program, int width, int height, float* rgb);
  // rgb [H, W, 3], and alpha [H, W] where not null.
  void BlendRgb(const ViewGeometry& geometry, float* rgb, float* alpha);

  std::shared_ptr<Backend> backend_;
  std::unique_ptr<Model> model_;
  std::array<float, 3> background_;
  std::shared_ptr<const LightMap> light_map_;
  Buffer<ColorProgram> encode_, decode_;  // to sRGB and back, with the map
  Buffer<float> curve_;
  bool makes_room_;
  std::shared_ptr<GeometryCache> cache_;
  std::unique_ptr<Scratch> scratch_;
};

}  // namespace retint
