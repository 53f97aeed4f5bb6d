// SPDX-License-Identifier: BSD-3-Clause
// One number a pixel, as programs write it.
#pragma once

#include <filesystem>

#include "scene/image.h"

namespace retint {

inline constexpr const char* kPixelFiles[] = {".npy", ".pfm", ".png"};

// The extension names the format. InputError for a file that is damaged or holds something else.
// - .npy: an array [H, W] in C order; further lengths must be 1. Its type is bool, double, or a
//   whole or floating number of at most 32 bits.
// - .pfm: one channel.
// - .png: gray. 8 bits are 0 to 255; 16 bits are divided by 256, as KITTI's disparities.
ScalarImage ReadPixels(const std::filesystem::path& path);

}  // namespace retint
