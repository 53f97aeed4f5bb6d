// SPDX-License-Identifier: BSD-3-Clause
// Whole-file reading and atomic writing. Every output is written beside its target and renamed over
// it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <type_traits>
#include <vector>

#include "base/error.h"

namespace retint {

// Whether there is a file or a folder of that name; false also where that cannot be told.
bool IsFile(const std::filesystem::path& path);
bool IsFolder(const std::filesystem::path& path);

// Paths of everything in a folder, or anywhere below it, in any order; links to folders are not
// followed. If reading fails, the part read until then; `error`, where given, says why.
std::vector<std::filesystem::path> ListFolder(const std::filesystem::path& folder,
                                              std::error_code* error = nullptr);
std::vector<std::filesystem::path> ListBelow(const std::filesystem::path& folder,
                                             std::error_code* error = nullptr);

// The path to which a file of this name is written: the target of a link, which need not exist; a
// device and a pipe as they are named. RunError for links that never end.
std::filesystem::path FollowLinks(const std::filesystem::path& path);

// The whole file; InputError when it is missing, a folder, or unreadable.
std::string ReadFile(const std::filesystem::path& path);

// Writes a file completely or not at all. Bytes go to a hidden temporary file in the same folder;
// Commit() flushes it and renames it to `path`. Without Commit() the destructor removes it, so a
// failed or cancelled write leaves the old file and no new folders. Parent folders are created, a
// link is followed. Every failure (unwritable folder, full disk, a folder or device of that name)
// is a RunError naming `path`; OptionError for an input (base/input_guard.h).
class AtomicFile {
 public:
  explicit AtomicFile(std::filesystem::path path);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  void Write(const void* data, size_t bytes);
  void Write(std::string_view text) { Write(text.data(), text.size()); }
  template <typename T>
  void WriteValue(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    Write(&value, sizeof(T));
  }
  // Appends the first `bytes` of an open file, as the very first thing that is written: shares its
  // blocks where the file system can (FICLONE), else the kernel copies them. `report` is told how
  // far it is and may throw.
  void CopyFrom(int file, uint64_t bytes, const std::function<void(uint64_t done)>& report);
  // Over the bytes written already.
  void WriteAt(uint64_t offset, const void* data, size_t bytes);
  // Flushes the bytes so far to the disk, without renaming. For files that belong together, Sync()
  // all, then Commit() all: if the disk is full, every old one stays.
  void Sync();
  void Commit();

 private:
  void CreateFolders();
  void RemoveCreatedFolders();
  void Flush();
  [[noreturn]] void Fail(const char* action) const;

  std::filesystem::path path_, temporary_;
  std::vector<std::filesystem::path> created_folders_;  // innermost first
  int fd_ = -1;
  std::vector<char> buffer_;
};

void WriteFile(const std::filesystem::path& path, std::string_view bytes);

// Bounds-checked little-endian cursor over the bytes of `path`; every overrun is an
// InputError("truncated ...").
class ByteReader {
 public:
  ByteReader(std::string_view bytes, std::filesystem::path path)
      : bytes_(bytes), path_(std::move(path)) {}

  template <typename T>
  T Read(std::string_view what) {
    static_assert(std::is_trivially_copyable_v<T>);
    Require(1, sizeof(T), what);
    T value;
    std::memcpy(&value, bytes_.data() + offset_, sizeof(T));
    offset_ += sizeof(T);
    return value;
  }
  std::string_view ReadBytes(uint64_t count, std::string_view what) {
    Require(count, 1, what);
    const auto out = bytes_.substr(offset_, count);
    offset_ += count;
    return out;
  }
  // Throws unless `count` records of at least `min_bytes` each can still follow: call it before
  // taking memory for them.
  void Require(uint64_t count, uint64_t min_bytes, std::string_view what) const;
  uint64_t Remaining() const { return bytes_.size() - offset_; }
  uint64_t Offset() const { return offset_; }
  const std::filesystem::path& Path() const { return path_; }

 private:
  std::string_view bytes_;
  std::filesystem::path path_;
  uint64_t offset_ = 0;
};

}  // namespace retint
