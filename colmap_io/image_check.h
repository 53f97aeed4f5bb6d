// SPDX-License-Identifier: BSD-3-Clause
// Internal to colmap_io: looks through a PNG or JPEG file before a decoder sees it, so that a
// cut-off or damaged one is an error (decoders fill in gray and print) and a size that the file
// cannot hold takes no memory.
#pragma once

#include <filesystem>
#include <string_view>

namespace retint {

// InputError naming the fault. Other formats pass unless they are empty.
void CheckImageFile(std::string_view bytes, const std::filesystem::path& path);

}  // namespace retint
