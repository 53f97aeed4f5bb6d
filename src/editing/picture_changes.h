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

// Takes the difference back to 0 where what differs, by more than `least`, is no more than a thin
// strip along the end of `inside`: pixels there show what lies beyond too, or the brush ran over.
void DropRim(ScalarImage& difference, const ScalarImage& least, const Mask& inside);

// Takes the difference back to 0 but for what is connected and strong: where a map of colors
// explains nearly all, lettering is paint, and faint or single pixels beside it are none.
void DropStray(ScalarImage& difference, const ScalarImage& least);

// A mask without what a brush touched beyond the thing that it painted: strips along the mask's
// end, some pixels wide, that lie behind, past a jump in `depth` [H, W].
Mask WithoutSpill(Mask mask, const DepthMap& depth);

// The mask and the pixels around, up to 1.5 % of the smaller side away: lettering and its
// surroundings.
Mask Widened(Mask mask);

// What was painted on a view inside `inside`: where `difference` from what the rest of the edit
// makes of the view is more than `least`, and what lies in narrow gaps between. At the end of the
// selection, the paint goes on for two pixels in the colors that it has nearby, for views whose
// pixels reach a little farther. All have the view's size. None where nothing was painted.
std::optional<PaintLayer> PaintedLayer(const std::string& view, Image8 picture,
                                       const ScalarImage& difference, const ScalarImage& least,
                                       const Mask& inside);

}  // namespace retint
