// SPDX-License-Identifier: BSD-3-Clause
// Internal to colmap_io: JPEG through libjpeg itself. OpenCV's decoder prints libjpeg's complaints
// and hands out a picture with gray or smeared blocks; here damage is an error and nothing prints.
#pragma once

#include <filesystem>
#include <optional>
#include <string_view>

#include "scene/image.h"

namespace retint {

bool IsJpeg(std::string_view bytes);

// Gray and the four inks (CMYK, YCCK) become RGB, without color management. InputError for a
// damaged file or an unsupported kind (12 bits).
Image8 DecodeJpeg(std::string_view bytes, const std::filesystem::path& path);

// The picture as it comes out of a JPEG file that was written with the quantization and the
// subsampling of `like`. None where `like` is damaged or has other than three channels.
std::optional<Image8> RecodeJpeg(const Image8& picture, std::string_view like);

}  // namespace retint
