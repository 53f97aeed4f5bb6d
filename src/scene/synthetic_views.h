// SPDX-License-Identifier: BSD-3-Clause
// Cameras and ray-traced views of a synthetic world. Internal to the synthetic scenes.
#pragma once

#include <vector>

#include "scene/synthetic.h"
#include "scene/synthetic_light.h"

namespace retint::synthetic {

// A view with what the later stages ask of it.
struct TracedView {
  PosedCamera camera;
  SyntheticView truth;
  PixelArray<int16_t, 1> parts;  // part at the pixel centre, -1 none
};

// The ray through a pixel position whose t is z.
Ray PixelRay(const PosedCamera& camera, double x, double y);

std::vector<PosedCamera> MakeArc(const SyntheticOptions& options);
TracedView TraceView(const World& world, const Lighting& lighting, const PosedCamera& camera);

// The views that see each object whole (see SyntheticScene::whole_views).
std::vector<std::vector<int>> FindWholeViews(const World& world,
                                             const std::vector<TracedView>& views);

// Whether `view` sees the surface point `point` of `part`: inside the image and nothing nearer.
bool Sees(const TracedView& view, int part, const Vec3& point, double* x, double* y);

}  // namespace retint::synthetic
