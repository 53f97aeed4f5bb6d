// SPDX-License-Identifier: BSD-3-Clause
// How well the depths of two views agree. If two depths differ by more than usual, they belong to
// two surfaces. docs/decisions/0037 lists rejected alternatives.
#pragma once

#include <vector>

#include "kernels/device.h"
#include "scene/camera.h"
#include "scene/image.h"

namespace retint {

// Up to this relative difference, two depths surely show one surface. A larger tolerance of a scene
// could join an object with the wall behind it.
inline constexpr float kSameSurface = 0.005f;

// A view's depths, 0 where it shows no surface.
struct DepthView {
  PosedCamera camera;
  DepthMap depth;
};

// `depth`: [H, W], in the memory of `device`.
DepthView Downloaded(Device& device, const PosedCamera& posed, const Buffer<float>& depth);

// Adds relative differences |z - z'| / z' of at most `most` to `differences`. z' is the depth of
// `other`, z that of `view` in the same point, seen from `other`. Compares every fourth row and
// column of `view`.
void AddDifferences(const DepthView& view, const DepthView& other, float most,
                    std::vector<float>* differences);

// Three times the 80 % quantile of `differences`, within [kSameSurface, `most`]; `most` if there
// are none. Reorders `differences`.
float AgreeingTolerance(std::vector<float>& differences, float most);

}  // namespace retint
