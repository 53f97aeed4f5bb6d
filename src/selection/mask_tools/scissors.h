// SPDX-License-Identifier: BSD-3-Clause
// Intelligent scissors: an outline that follows edges from point to point.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "scene/image.h"

namespace retint {

// The inside of a closed outline through `anchors` (at least three pixels) in their order, along
// the edges of `color` (Mortensen and Barrett 1995). Between two anchors it stays within a third of
// their distance (at least 8 pixels) of the straight line, and follows the line if there is no
// edge. OptionError for fewer anchors, or for one outside the picture.
Mask CutOut(const Image& color, const std::vector<Eigen::Vector2i>& anchors);

}  // namespace retint
