// SPDX-License-Identifier: BSD-3-Clause
// A picture after a lossy WebP file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "scene/image.h"

namespace retint {

// By the file's bytes; a lossless one keeps every pixel.
bool IsLossyWebp(std::string_view file);

// A WebP file does not say its quality. The one, 1 to 100, at which a file of `picture` has about
// `bytes` bytes: its loss is then about the same.
int WebpQuality(const Image8& picture, size_t bytes);

// A lossy file of that quality.
std::vector<uint8_t> EncodeWebp(const Image8& picture, int quality);
// A picture as it comes out of one.
Image8 AsWebpHolds(const Image8& picture, int quality);

}  // namespace retint
