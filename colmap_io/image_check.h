// SPDX-License-Identifier: BSD-3-Clause
// Internal to colmap_io: checks a PNG or JPEG file before a decoder reads it. So a cut-off or
// damaged file is an error (decoders fill in gray and print), and a size that is impossible for the
// file allocates no memory.
#pragma once

#include <filesystem>
#include <string_view>

namespace retint {

// InputError naming the fault. Other formats pass unless they are empty.
void CheckImageFile(std::string_view bytes, const std::filesystem::path& path);

}  // namespace retint
