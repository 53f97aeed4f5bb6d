// SPDX-License-Identifier: BSD-3-Clause
// Internal to colmap_io: JPEG through libjpeg itself. OpenCV's decoder prints libjpeg's complaints
// and hands out a picture with gray or smeared blocks; here damage is an error and nothing prints.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
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

// The file `like` with the pixels of `picture`, which has its size: with its quantization, its
// subsampling and its metadata. Blocks of 8 x 8 coefficients in which `picture` has the pixels of
// `held`, which is DecodeJpeg() of `like`, keep their values. A gray file becomes one of three
// channels. InputError where `like` is of four inks.
std::string WithPixels(const Image8& picture, const Image8& held, std::string_view like,
                       const std::filesystem::path& path);

}  // namespace retint
