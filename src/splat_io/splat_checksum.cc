// SPDX-License-Identifier: BSD-3-Clause
#include "splat_io/splat_checksum.h"

#include <string>
#include <vector>

#include "splat_io/splat_io.h"

namespace retint {

FileChecksum ChecksumSplat(const std::filesystem::path& path) {
  const std::vector<std::filesystem::path> files = SplatFiles(path);
  FileChecksum sum = ChecksumFile(path);
  if (files.size() == 1) return sum;
  Xxh64Stream all;
  for (const std::filesystem::path& file : files) {
    all.Add(file.filename().string() + '\n' + HexText(ChecksumFile(file).xxh64));
  }
  sum.xxh64 = all.Get();
  return sum;
}

}  // namespace retint
