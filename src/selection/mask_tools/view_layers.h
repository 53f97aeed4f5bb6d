// SPDX-License-Identifier: BSD-3-Clause
// The layers of one view for the tools that look for an outline.
#pragma once

#include <array>

#include "scene/camera.h"
#include "scene/grid_rect.h"
#include "scene/image.h"

namespace retint {

struct ViewLayers {
  PosedCamera camera;
  // Of a distorted camera's own picture (PhotoRays()): the point that a pixel shows at depth 1, in
  // the camera's frame; 0 where no ray leads. Empty: a pinhole camera's.
  PixelArray<float, 3> rays;
  Image color;     // a render or a photo
  DepthMap depth;  // may be empty: then color alone decides
  // The depth of surfaces, also of those that let much light through, which a mean depth puts far
  // behind (SurfaceOptions::median). Empty: `depth`.
  DepthMap surface;
  const DepthMap& Surface() const { return surface.Empty() ? depth : surface; }
};

// OptionError unless color and depth (where there is one) have one size, of a pixel at least.
void CheckLayers(const ViewLayers& layers);

// The point of the world that a pixel with depth shows, and the unit normal there, in the camera's
// frame, toward the camera; of a picture with rays, 0 where no neighbor has depth.
Eigen::Vector3d SurfacePoint(const ViewLayers& layers, int x, int y);
Eigen::Vector3d SurfaceNormal(const ViewLayers& layers, int x, int y);

// The point that `at`, in pixels, shows at depth 1, in the camera's frame; of a picture with rays,
// beyond its border that of the border.
Eigen::Vector3d RayAt(const ViewLayers& layers, const Eigen::Vector2d& at);

// At the middle of the view, of a picture with rays at most of its pixels; as many as it is
// wide where the camera says nothing.
double PixelsPerRadian(const ViewLayers& layers);

// OKLab units for a depth e times as large.
inline constexpr float kFeaturesPerLogDepth = 0.5f;
// OKLab, and the logarithm of the depth in comparable units about its median, at most 1.5 away from
// it before they are. Where there is no depth the surface is far. [height, width, 4] of `part`.
PixelArray<float, 4> Features(const ViewLayers& layers, const GridRect& part);
PixelArray<float, 4> Features(const ViewLayers& layers);  // of all

}  // namespace retint
