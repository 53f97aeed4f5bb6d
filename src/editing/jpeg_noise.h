// SPDX-License-Identifier: BSD-3-Clause
// What a JPEG or a lossy WebP file does to a picture is no change of it.
#pragma once

#include <filesystem>

#include "scene/image.h"

namespace retint {

// DeltaE00 [H, W] between a picture and the view that it was made from, above which a pixel was
// changed: LeastChange(), and four times the nearby noise of a file that the view is saved to. If
// `file`, from which the picture was read, is a JPEG, that file has its quantization and
// subsampling; if it is a lossy WebP, the quality at which the view makes a file of its size. So
// the threshold is high at edges and low elsewhere. No file, or another format: no noise.
ScalarImage LeastChanges(const Image8& picture, const Image& view,
                         const std::filesystem::path& file);

}  // namespace retint
