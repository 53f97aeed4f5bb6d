// SPDX-License-Identifier: BSD-3-Clause
// Views that no camera took, between those that cameras did: more sides from which a selection is
// looked at, where cameras are few.
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "scene/camera.h"

namespace retint {

// At most `count` views of `middle` with the pixels and the lens of `lens`. By their directions
// from `middle`, about the mean vertical of the cameras, the cameras have gaps between them. Views
// part these evenly, the widest first, until none is wider than 15 degrees. A gap of more than 180
// degrees is left: nobody looked at the part beyond it. A view's height and distance change evenly
// from the camera on one side of its gap to that on the other; it looks at `middle`. Cameras that
// have `middle` behind them, or nearer than anything is drawn, do not count. None where fewer than
// two cameras count, or where they have no common vertical.
std::vector<PosedCamera> ViewsBetween(const std::vector<PosedCamera>& cameras,
                                      const Eigen::Vector3d& middle, const Camera& lens,
                                      size_t count);

}  // namespace retint
