// SPDX-License-Identifier: BSD-3-Clause
// Internal to colmap_io: JPEG through libjpeg itself. OpenCV's decoder prints libjpeg's complaints
// and hands out a picture with gray or smeared blocks; here damage is an error and nothing prints.
#pragma once

#include <filesystem>
#include <string_view>

#include "scene/image.h"

namespace retint {

bool IsJpeg(std::string_view bytes);

// Gray and the four inks (CMYK, YCCK) become RGB, without color management. InputError for a
// damaged file or an unsupported kind (12 bits).
Image8 DecodeJpeg(std::string_view bytes, const std::filesystem::path& path);

}  // namespace retint
