// SPDX-License-Identifier: BSD-3-Clause
// The noise of a JPEG or a lossy WebP file is no change of a picture.
#pragma once

#include <filesystem>

#include "scene/image.h"

namespace retint {

// Thresholds, DeltaE00 [H, W], above which a pixel of a picture counts as changed from the view
// that it was made from. They are at least LeastChange() of the whole. If `file`, from which the
// picture was read, is a JPEG or a lossy WebP, the view is compressed in the same way: with the
// JPEG's quantization and subsampling, or to the size of the WebP. The noise of that raises the
// thresholds, and so does the noise around nearby changes, in blocks of up to 16 pixels. So they
// are high at edges, and low elsewhere. If `file` is empty or missing, the picture counts as not
// compressed.
ScalarImage LeastChanges(const Image8& picture, const Image& view,
                         const std::filesystem::path& file);

}  // namespace retint
