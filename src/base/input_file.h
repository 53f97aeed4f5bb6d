// SPDX-License-Identifier: BSD-3-Clause
// Random access to a file of known length, for codecs that stream instead of holding the whole
// file.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <thread>

namespace retint {

class InputFile {
 public:
  // InputError when it is missing, a folder, or unreadable. `is_input`: an output must not replace
  // it (base/input_guard.h).
  explicit InputFile(std::filesystem::path path, bool is_input = true);
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

// Makes the system read a file from begin to end in the background, as long as this lives. A disk
// is fastest that way, while codecs allocate memory and then read in many places. It does nothing
// if the system has the file's end in its memory already. It is a hint: if it fails, the readers of
// the file report the error.
class ReadAhead {
 public:
  explicit ReadAhead(const std::filesystem::path& path);
  ~ReadAhead();
  ReadAhead(const ReadAhead&) = delete;
  ReadAhead& operator=(const ReadAhead&) = delete;

 private:
  void Read();

  std::unique_ptr<const InputFile> file_;
  std::atomic<bool> stop_ = false;
  std::thread reader_;
};

}  // namespace retint
