// SPDX-License-Identifier: BSD-3-Clause
// Random access to a file of known length, for codecs that stream instead of holding the whole
// file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>

namespace retint {

class InputFile {
 public:
  // InputError when it is missing, a folder, or unreadable.
  explicit InputFile(std::filesystem::path path);
  ~InputFile();
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;

  const std::filesystem::path& path() const { return path_; }
  uint64_t size() const { return size_; }
  int descriptor() const { return fd_; }
  // Reads exactly `bytes`; InputError when the file ends sooner.
  void ReadAt(uint64_t offset, void* data, size_t bytes) const;

 private:
  std::filesystem::path path_;
  uint64_t size_ = 0;
  int fd_ = -1;
};

}  // namespace retint
