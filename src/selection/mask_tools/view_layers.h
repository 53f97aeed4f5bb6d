// SPDX-License-Identifier: BSD-3-Clause
// The layers of one view for tools that find an outline.
#pragma once

#include <array>

#include "scene/camera.h"
#include "scene/grid_rect.h"
#include "scene/image.h"

namespace retint {

struct ViewLayers {
  PosedCamera camera;
  // For the distorted camera of a picture (PhotoRays()): the point at depth 1 in each pixel, in the
  // camera frame; 0 if the pixel has no ray. Empty: the camera is a pinhole.
  PixelArray<float, 3> rays;
  Image color;     // a render or a photo
  DepthMap depth;  // may be empty: then only color counts
  // The median depth (SurfaceOptions::median). For translucent surfaces it is right, while the mean
  // depth is far behind them. Empty: use `depth`.
  DepthMap surface;
  const DepthMap& Surface() const { return surface.Empty() ? depth : surface; }
};

// OptionError unless color and depth (if not empty) have the same size, at least one pixel.
void CheckLayers(const ViewLayers& layers);

// The world point that a pixel with depth shows, and the surface's unit normal there in the camera
// frame, toward the camera. With rays, the normal is 0 if no neighbor has depth.
Eigen::Vector3d SurfacePoint(const ViewLayers& layers, int x, int y);
Eigen::Vector3d SurfaceNormal(const ViewLayers& layers, int x, int y);

// The point at depth 1 in pixel `at`, in the camera frame. With rays, points outside the picture
// get the ray of its border.
Eigen::Vector3d RayAt(const ViewLayers& layers, const Eigen::Vector2d& at);

// In the middle of the view; with rays, the median over pixels. The view's width if the camera does
// not say it.
double PixelsPerRadian(const ViewLayers& layers);

// A depth e times as large is this far away in OKLab units.
inline constexpr float kFeaturesPerLogDepth = 0.5f;
// OKLab, and kFeaturesPerLogDepth * ln(depth / median depth), the logarithm within [-1.5, 1.5].
// Pixels without depth count as far. [height, width, 4] of `part`.
PixelArray<float, 4> Features(const ViewLayers& layers, const GridRect& part);
PixelArray<float, 4> Features(const ViewLayers& layers);  // of all

}  // namespace retint
