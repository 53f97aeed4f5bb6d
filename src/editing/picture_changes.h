// SPDX-License-Identifier: BSD-3-Clause
// From the difference between a picture and its view to the paint there.
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "recolor/picture_edit.h"
#include "scene/image.h"

namespace retint {

// DeltaE00 between a picture and the view that it was made from, above which it was changed. It is
// 2, below which nobody sees a change, or more if the whole picture is as noisy as a JPEG file.
float LeastChange(const Image8& picture, const Image& view);

// How many pixels differ by more than `least`.
size_t CountDifferent(const ScalarImage& difference, const ScalarImage& least);

// 255 where the difference [H, W], DeltaE00, is more than `least` and so are some neighbors', and
// one pixel around.
Mask ChangedPixels(const ScalarImage& difference, const ScalarImage& least);

// 255 in the pixels around a mask, up to 3 % of the smaller side away.
Mask Surroundings(const Mask& mask);

// Resets differences above `least` to 0 if they form only a thin strip along the end of `inside`.
// Pixels there also show the background, or the brush ran over.
void DropRim(ScalarImage& difference, const ScalarImage& least, const Mask& inside);

// Resets the difference to 0 except in connected, strong parts. If a color map explains nearly all,
// lettering stays, and faint or single pixels are dropped.
void DropStray(ScalarImage& difference, const ScalarImage& least);

// A mask without the pixels that a brush touched beyond the painted thing: strips along the mask's
// end, some pixels wide, on surfaces behind a jump in `depth` [H, W].
Mask WithoutSpill(Mask mask, const DepthMap& depth);

// The mask and the pixels around, up to 1.5 % of the smaller side away: lettering and its
// surroundings.
Mask Widened(Mask mask);

// The painted layer of a view, inside `inside`: the pixels whose `difference` from the rest of the
// edit is more than `least`, and narrow gaps between them. At the end of the selection, the layer
// goes on for two pixels in the nearby painted colors, for views whose pixels reach a little
// farther. All have the view's size. None if nothing was painted.
std::optional<PaintLayer> PaintedLayer(const std::string& view, Image8 picture,
                                       const ScalarImage& difference, const ScalarImage& least,
                                       const Mask& inside);

}  // namespace retint
