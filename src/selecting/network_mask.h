// SPDX-License-Identifier: BSD-3-Clause
// Strokes from the outline that a network proposes.
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
// strokes. Strokes that the user drew, each of the image's size or empty, and points of `prompt`
// always hold; the network sees a few points of the strokes, too. InputError if the network finds
// nothing, or only the whole view.
Strokes StrokesOf(const MaskNetwork& network, const Image& color, Strokes drawn,
                  ObjectPrompt prompt, Monitor& monitor);

}  // namespace retint
