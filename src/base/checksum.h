// SPDX-License-Identifier: BSD-3-Clause
// XXH64 (Yann Collet's xxHash, 64 bits, seed 0): fast, not cryptographic. `xxhsum -H1 FILE` prints
// the same.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace retint {

uint64_t Xxh64(std::string_view bytes);

// Of bytes that come in parts.
class Xxh64Stream {
 public:
  Xxh64Stream();
  void Add(std::string_view bytes);
  uint64_t Get() const;

 private:
  uint64_t lanes_[4];
  char rest_[32];
  size_t rest_size_ = 0;
  uint64_t total_ = 0;
};

struct FileChecksum {
  uint64_t bytes = 0, xxh64 = 0;
  bool operator==(const FileChecksum&) const = default;
};

// Reads the file in parts of bounded size; InputError when it cannot be read.
FileChecksum ChecksumFile(const std::filesystem::path& path);

// Sixteen hexadecimal digits.
std::string HexText(uint64_t value);

}  // namespace retint
