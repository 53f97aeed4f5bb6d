// SPDX-License-Identifier: BSD-3-Clause
// The world of a synthetic scene, to be traced along any rays. Internal to the synthetic scenes.
#pragma once

#include <functional>
#include <optional>

#include "base/monitor.h"
#include "synthetic/light.h"
#include "synthetic/synthetic_scene.h"
#include "synthetic/world.h"

namespace retint::synthetic {

class SyntheticTracer {
 public:
  // The world of MakeSyntheticScene(options), lit. Stage: "light".
  SyntheticTracer(const SyntheticOptions& options, Monitor& monitor);

  // The ray through a pixel position; nullopt: none leads there, the pixel is black.
  using RayOf = std::function<std::optional<Ray>(double x, double y)>;
  // A view without a name. Depth is t of its rays.
  SyntheticView Trace(int width, int height, const RayOf& ray_of) const;

 private:
  World world_;
  Lighting lighting_;  // after the world, which it reads
};

}  // namespace retint::synthetic
