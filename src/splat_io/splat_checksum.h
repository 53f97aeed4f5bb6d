// SPDX-License-Identifier: BSD-3-Clause
// Checksums that tell two states of a splat apart, even of a splat in several files.
#pragma once

#include <filesystem>

#include "base/checksum.h"

namespace retint {

// Size and checksum of the file `path`. If other files belong to it (SplatFiles()), the checksum is
// that of all names and checksums. InputError as SplatFiles().
FileChecksum ChecksumSplat(const std::filesystem::path& path);

}  // namespace retint
