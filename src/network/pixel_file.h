// SPDX-License-Identifier: BSD-3-Clause
// One number a pixel, as programs write it.
#pragma once

#include <filesystem>

#include "scene/image.h"

namespace retint {

inline constexpr const char* kPixelFiles[] = {".npy", ".pfm", ".png"};

// By the extension; InputError for a file that is damaged or holds something else.
// - .npy: an array [H, W], beside which lengths of 1 do not count, in C order: bool, bytes, 16 or
// 32
//   bits, whole or not, or double.
// - .pfm: of one channel.
// - .png: gray; 8 bits are 0 to 255, and 16 bits are divided by 256, as KITTI's disparities.
ScalarImage ReadPixels(const std::filesystem::path& path);

}  // namespace retint
