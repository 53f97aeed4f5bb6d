// SPDX-License-Identifier: BSD-3-Clause
// Cameras and ray-traced views of a synthetic world. Internal to the synthetic scenes.
#pragma once

#include <vector>

#include "synthetic/light.h"
#include "synthetic/synthetic_scene.h"

namespace retint::synthetic {

// A view with what the later stages ask of it.
struct TracedView {
  PosedCamera camera;
  SyntheticView truth;
  PixelArray<int16_t, 1> parts;  // part at the pixel center, -1 none
  int padding = 0;               // pixels traced beyond every border of the actual image
};

// The ray through a pixel position whose t is z.
Ray PixelRay(const PosedCamera& camera, double x, double y);

Vec3 MiddleOfCameras(const std::vector<TracedView>& views);
std::vector<PosedCamera> MakeArc(const SyntheticOptions& options);
// `padding` widens the image on all sides.
TracedView TraceView(const World& world, const Lighting& lighting, const PosedCamera& camera,
                     int padding = 0);
// The view without its padding.
TracedView Crop(const TracedView& view);

// The views that see each object whole (see SyntheticScene::whole_views).
std::vector<std::vector<int>> FindWholeViews(const World& world,
                                             const std::vector<TracedView>& views);

// Whether `view` sees the surface point `point` of `part`: inside the image and nothing nearer.
bool Sees(const TracedView& view, int part, const Vec3& point, double* x, double* y);

}  // namespace retint::synthetic
