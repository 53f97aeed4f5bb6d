// SPDX-License-Identifier: BSD-3-Clause
// What is known of each pixel of a view: whether it shows the selection, and how surely.
#pragma once

#include <string>
#include <vector>

#include "scene/camera.h"
#include "scene/image.h"

namespace retint {

// A painted view with the depth that it sees.
struct PaintedSurface {
  std::string name;
  PosedCamera camera;
  const Mask* mask = nullptr;
  DepthMap depth;
};

struct Evidence {
  ScalarImage inside;  // M in [0, 1]
  ScalarImage weight;  // K >= 0
};

// The paint as it stands.
Evidence PaintedEvidence(const Mask& mask, double weight);

// Looks the surface of each pixel (its `depth` unprojected) up in the painted views: where the
// depth there agrees within `tolerance`, the paint is its value, the mean where several see it.
// Weight 1 where any does, `unknown_weight` elsewhere.
Evidence LookUpPaint(const PosedCamera& view, const DepthMap& depth,
                     const std::vector<PaintedSurface>& painted, double tolerance,
                     double unknown_weight);

// Adds what the cloud covers: the larger value, with a weight of at least the coverage.
void AddCoverage(const Mask& coverage, Evidence* evidence);

}  // namespace retint
