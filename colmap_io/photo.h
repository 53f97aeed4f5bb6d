// SPDX-License-Identifier: BSD-3-Clause
// Photos as they come out of cameras, scanners and other tools, in the size of a model's camera.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>

#include "scene/image.h"

namespace retint {

// Width and height as stored, of a PNG or JPEG file; nullopt for other and for damaged files.
std::optional<std::pair<int, int>> ReadImageSize(const std::filesystem::path& path);

// Has the bytes of a TIFF file say that its pixels are to be shown as they are stored, which its
// decoder would turn else. Other bytes stay as they are.
void KeepTiffAsStored(std::string* bytes);

// See Workspace::ReadPhoto(). InputError as ReadImage(), or naming both sizes.
Image ReadPhotoOfSize(const std::filesystem::path& path, int width, int height);

}  // namespace retint
