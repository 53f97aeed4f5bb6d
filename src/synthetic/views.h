// SPDX-License-Identifier: BSD-3-Clause
// Cameras and ray-traced views of a synthetic world, and the data made from them. Internal to the
// synthetic scenes.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "synthetic/light.h"
#include "synthetic/synthetic_scene.h"

namespace retint::synthetic {

// A view with the data for the later stages.
struct TracedView {
  PosedCamera camera;
  SyntheticView truth;
  PixelArray<int16_t, 1> parts;  // part at the pixel center, -1 none
  int padding = 0;               // pixels traced beyond every border of the actual image

  Vec3 NormalAt(int x, int y) const {
    const auto& n = truth.normals;
    return {n(x, y, 0), n(x, y, 1), n(x, y, 2)};
  }
};

Vec3 MiddleOfCameras(const std::vector<TracedView>& views);
std::vector<PosedCamera> MakeArc(const SyntheticOptions& options);

// The ray through a pixel position; nullopt: none leads there, the pixel is black.
using RayOf = std::function<std::optional<Ray>(double x, double y)>;
// A view without a camera. Depth is t of its rays.
TracedView TraceRays(const World& world, const Lighting& lighting, int width, int height,
                     const RayOf& ray_of);
// `padding` widens the image on all sides.
TracedView TraceView(const World& world, const Lighting& lighting, const PosedCamera& camera,
                     int padding);
// The view without its padding.
TracedView Crop(const TracedView& view);

// The views that see each object whole (see SyntheticScene::whole_views).
std::vector<std::vector<int>> FindWholeViews(const World& world,
                                             const std::vector<TracedView>& views);

// Gaussians: flat discs on every surface that a view sees, as small as the texture there demands.
GaussianModel MakeGaussians(const World& world, const Lighting& lighting,
                            const std::vector<TracedView>& views, const SyntheticOptions& options,
                            Monitor& monitor);

// Adds sparse points as structure from motion would leave them: on corners of the texture, tracked
// through the views that see them, triangulated from noisy observations. Views (ids from 1, in the
// order of `views`) and cameras are there already.
void AddSparsePoints(const World& world, const std::vector<TracedView>& views,
                     const SyntheticOptions& options, Reconstruction* reconstruction);

// Where `view` sees the surface point `point` of `part`: inside the image and nothing nearer.
std::optional<Vec2> Sees(const TracedView& view, int part, const Vec3& point);

}  // namespace retint::synthetic
