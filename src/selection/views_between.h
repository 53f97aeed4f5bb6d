// SPDX-License-Identifier: BSD-3-Clause
// Views between the cameras: more sides to look at a selection from, for scenes with few cameras.
// No camera took these.
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "scene/camera.h"

namespace retint {

// At most `count` views of `middle` with the size and lens of `lens`. The cameras' directions from
// `middle`, about their mean vertical, leave gaps. Views divide these evenly, the widest gap first,
// until none is wider than 15 degrees. A gap of more than 180 degrees stays, because no camera saw
// the part beyond it. Height and distance of a view change evenly from one camera of the gap to the
// other, and it looks at `middle`. Cameras do not count if `middle` is behind them or nearer than
// anything that is drawn. Empty if fewer than two cameras count, or if they have no common
// vertical.
std::vector<PosedCamera> ViewsBetween(const std::vector<PosedCamera>& cameras,
                                      const Eigen::Vector3d& middle, const Camera& lens,
                                      size_t count);

}  // namespace retint
