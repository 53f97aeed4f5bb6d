// SPDX-License-Identifier: BSD-3-Clause
// Photos as they come out of cameras, scanners and other tools, in the size of a model's camera.
#pragma once

#include <filesystem>
#include <optional>
#include <utility>

#include "scene/image.h"

namespace retint {

// Width and height as stored, of a PNG or JPEG file; nullopt for other and for damaged files.
std::optional<std::pair<int, int>> ReadImageSize(const std::filesystem::path& path);

// See Workspace::ReadPhoto(). InputError as ReadImage(), or naming both sizes.
Image ReadPhotoOfSize(const std::filesystem::path& path, int width, int height);

}  // namespace retint
