// SPDX-License-Identifier: BSD-3-Clause
// Photos as they come out of cameras, scanners and other tools, in the size of a model's camera.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "scene/image.h"

namespace retint {

// Width and height as stored, by the header of a PNG, JPEG, TIFF, WebP or BMP file; nullopt for
// other and for damaged files.
std::optional<std::pair<int, int>> ImageSizeIn(std::string_view bytes);
std::optional<std::pair<int, int>> ReadImageSize(const std::filesystem::path& path);

// Has the bytes of a TIFF file say that its pixels are to be shown as they are stored, which its
// decoder would turn else. Other bytes stay as they are.
void KeepTiffAsStored(std::string* bytes);

// The EXIF orientation, 5 to 8, by which a photo must be turned to fit a camera of this size. It is
// 1 if the stored shape fits, perhaps in another size. InputError naming both sizes.
int TurnForCamera(const std::filesystem::path& path, std::string_view bytes, int width, int height);
// Stored rows and columns as they are shown, and back.
Image Turned(const Image& stored, int orientation);
Image TurnedBack(const Image& shown, int orientation);

// See Workspace::ReadPhoto(). InputError as ReadImage(), or naming both sizes.
Image ReadPhotoOfSize(const std::filesystem::path& path, int width, int height);

}  // namespace retint
