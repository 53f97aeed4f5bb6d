// SPDX-License-Identifier: BSD-3-Clause
// The noise of a JPEG or a lossy WebP file is no change of a picture.
#pragma once

#include <filesystem>

#include "scene/image.h"

namespace retint {

// DeltaE00 [H, W] between a picture and the view that it was made from, above which a pixel was
// changed: LeastChange() of the whole. Where `file`, from which the picture was read, is a JPEG,
// the view is saved in the same way, with the file's own quantization and subsampling; where it is
// a lossy WebP, at the quality at which the view makes a file of its size. The noise of such a file
// in the view is no change then. Neither is its noise around paint nearby, which it smears over
// blocks of up to 16 pixels. So the threshold is high at edges, and low elsewhere. An empty path,
// or one that is not there, loses nothing.
ScalarImage LeastChanges(const Image8& picture, const Image& view,
                         const std::filesystem::path& file);

}  // namespace retint
