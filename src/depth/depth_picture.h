// SPDX-License-Identifier: BSD-3-Clause
// Depth as a picture for people.
#pragma once

#include "scene/image.h"

namespace retint {

// Near warm, far cold (the Turbo color map over inverse depth, between the 1 % and 99 %
// quantiles); pixels without depth are black. With `valid` (0/255, may be empty), pixels that are
// not valid are shown at half brightness.
Image8 DepthPicture(const DepthMap& depth, const Mask& valid = {});

}  // namespace retint
