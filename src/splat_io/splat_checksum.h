// SPDX-License-Identifier: BSD-3-Clause
// A mark that tells one state of a splat from another, also of one that is made of several files.
#pragma once

#include <filesystem>

#include "base/checksum.h"

namespace retint {

// The bytes of the file that is named, and its sum; where more files belong to it (SplatFiles()), a
// sum of the names and the sums of all. InputError as SplatFiles().
FileChecksum ChecksumSplat(const std::filesystem::path& path);

}  // namespace retint
