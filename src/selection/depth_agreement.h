// SPDX-License-Identifier: BSD-3-Clause
// How well the depths of two views agree. Depths that differ by more than the views' depths usually
// do belong to two surfaces; docs/decisions/0037 says what else was tried.
#pragma once

#include <vector>

#include "kernels/device.h"
#include "scene/camera.h"
#include "scene/image.h"

namespace retint {

// Relative difference in depth up to which two views surely show one surface. A thing and the wall
// behind it may lie closer together than that of two views that disagree.
inline constexpr float kSameSurface = 0.005f;

// A view's depths, 0 where it shows no surface.
struct DepthView {
  PosedCamera camera;
  DepthMap depth;
};

// `depth`: [H, W], in the memory of `device`.
DepthView Downloaded(Device& device, const PosedCamera& posed, const Buffer<float>& depth);

// Adds the relative differences |z - z'| / z' of at most `most` to `differences`: z' is the depth
// of `other`, z that of `view` as seen from there. Every fourth row and column of `view` is
// compared.
void AddDifferences(const DepthView& view, const DepthView& other, float most,
                    std::vector<float>* differences);

// Three times the difference that 80 % of `differences` keep within, at least kSameSurface and at
// most `most`; `most` if there are none. Reorders `differences`.
float AgreeingTolerance(std::vector<float>& differences, float most);

}  // namespace retint
