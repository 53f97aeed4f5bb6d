// SPDX-License-Identifier: BSD-3-Clause
// What a JPEG or a lossy WebP file does to a picture is no change of it.
#pragma once

#include <filesystem>

#include "scene/image.h"

namespace retint {

// DeltaE00 [H, W] between a picture and the view that it was made from, above which a pixel was
// changed: LeastChange() of the whole. Where `file`, from which the picture was read, is a JPEG,
// the view is saved in the same way, with the file's own quantization and subsampling; where it is
// a lossy WebP, at the quality at which the view makes a file of its size. What such a file makes
// of the view is no change then, and neither is what it makes of paint nearby: it smears paint over
// blocks of up to 16 pixels. So the threshold is high at edges, and low elsewhere. An empty path,
// or one that is not there, loses nothing.
ScalarImage LeastChanges(const Image8& picture, const Image& view,
                         const std::filesystem::path& file);

}  // namespace retint
