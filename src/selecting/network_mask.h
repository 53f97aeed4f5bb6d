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

// The inside and the outside of the network's outline of `color`, without the pixels within 1 % of
// the longer side from its border. Color, depth and other views decide about those, as between
// strokes. Strokes that the user drew, each of the image's size or empty, always hold. InputError
// if the network finds nothing, or only the whole view.
Strokes StrokesOf(const MaskNetwork& network, const Image& color, const Strokes& drawn,
                  Monitor& monitor);

}  // namespace retint
