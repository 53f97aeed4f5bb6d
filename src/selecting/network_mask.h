// SPDX-License-Identifier: BSD-3-Clause
// Internal to selecting: strokes from the outline that a network proposes.
#pragma once

#include "base/monitor.h"
#include "network/mask_network.h"
#include "scene/image.h"

namespace retint {

struct Strokes {
  Mask inside, outside;
};

// What is inside and outside of the network's outline of `color`, further from its border than 1 %
// of the longer side: what lies between, color, depth and other views decide, as between strokes.
// Strokes that the user drew, each of the image's size or empty, are proof. InputError if the
// network finds nothing, or nothing but the whole view.
Strokes StrokesOf(const MaskNetwork& network, const Image& color, const Strokes& drawn,
                  Monitor& monitor);

}  // namespace retint
