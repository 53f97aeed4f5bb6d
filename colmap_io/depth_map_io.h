// SPDX-License-Identifier: BSD-3-Clause
// COLMAP's dense depth maps, stereo/depth_maps/<image name>.{geometric,photometric}.bin: the text
// "W&H&1&", then W*H little-endian floats, row by row (COLMAP src/colmap/mvs/mat.h). Depth is z
// along the viewing axis in the model's unit; 0 for no depth.
#pragma once

#include <filesystem>

#include "scene/image.h"

namespace retint {

// InputError: missing, another number of channels, cut off or longer than W and H say, NaN or
// infinite values (with the pixel). Negative depths, which mean nothing, come back as 0.
DepthMap ReadDepthMap(const std::filesystem::path& path);

// ReadDepthMap reads it back byte for byte. RunError when it cannot be written.
void WriteDepthMap(const std::filesystem::path& path, const DepthMap& depth);

}  // namespace retint
