// SPDX-License-Identifier: BSD-3-Clause
#include "base/files.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>

namespace retint {
namespace {

constexpr size_t kBufferBytes = size_t{1} << 20;

std::filesystem::path TemporaryBeside(const std::filesystem::path& path) {
  static std::atomic<uint64_t> counter{0};
  std::string name = ".";
  name += path.filename().string() + "." + std::to_string(getpid()) + ".";
  name += std::to_string(counter++) + ".tmp";
  return path.parent_path() / name;
}

}  // namespace

std::string ReadFile(const std::filesystem::path& path) {
  const int fd = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) throw InputError(path, std::strerror(errno));
  struct stat info {};
  std::string bytes;
  const bool is_file = fstat(fd, &info) == 0 && S_ISREG(info.st_mode);
  size_t done = 0;
  ssize_t got = is_file ? 1 : -1;
  if (is_file) {
    bytes.resize(static_cast<size_t>(info.st_size));
    while (done < bytes.size() && (got = read(fd, bytes.data() + done, bytes.size() - done)) > 0) {
      done += static_cast<size_t>(got);
    }
  }
  const int code = errno;
  close(fd);
  if (!is_file) throw InputError(path, "not a file");
  if (got < 0) throw InputError(path, std::strerror(code));
  bytes.resize(done);
  return bytes;
}

AtomicFile::AtomicFile(std::filesystem::path path) : path_(std::move(path)) {
  if (path_.has_parent_path()) {
    std::error_code code;
    std::filesystem::create_directories(path_.parent_path(), code);
    if (code) throw RunError(path_.string() + ": cannot create its folder: " + code.message());
  }
  if (std::filesystem::is_directory(path_)) throw RunError(path_.string() + ": is a folder");
  temporary_ = TemporaryBeside(path_);
  fd_ = open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (fd_ < 0) Fail("cannot write");
  buffer_.reserve(kBufferBytes);
}

AtomicFile::~AtomicFile() {
  if (fd_ >= 0) {
    close(fd_);
    unlink(temporary_.c_str());
  }
}

void AtomicFile::Fail(const char* action) const {
  throw RunError(path_.string() + ": " + action + ": " + std::strerror(errno));
}

void AtomicFile::Write(const void* data, size_t bytes) {
  const auto* from = static_cast<const char*>(data);
  while (bytes > 0) {
    const size_t part = std::min(bytes, kBufferBytes - buffer_.size());
    buffer_.insert(buffer_.end(), from, from + part);
    from += part;
    bytes -= part;
    if (buffer_.size() == kBufferBytes) Flush();
  }
}

void AtomicFile::Flush() {
  size_t done = 0;
  while (done < buffer_.size()) {
    const ssize_t wrote = write(fd_, buffer_.data() + done, buffer_.size() - done);
    if (wrote < 0 && errno == EINTR) continue;
    if (wrote < 0) Fail("cannot write");
    done += static_cast<size_t>(wrote);
  }
  buffer_.clear();
}

void AtomicFile::Commit() {
  Flush();
  if (fsync(fd_) != 0) Fail("cannot write");
  const int fd = fd_;
  fd_ = -1;
  if (close(fd) != 0 || rename(temporary_.c_str(), path_.c_str()) != 0) {
    const int code = errno;
    unlink(temporary_.c_str());
    errno = code;
    Fail("cannot write");
  }
}

void WriteFile(const std::filesystem::path& path, std::string_view bytes) {
  AtomicFile file(path);
  file.Write(bytes);
  file.Commit();
}

void ByteReader::Require(uint64_t count, uint64_t min_bytes, std::string_view what) const {
  if (min_bytes > 0 && count > Remaining() / min_bytes) {
    throw InputError(path_, "truncated: " + std::to_string(count) + " " + std::string(what) +
                                " need " + std::to_string(min_bytes) + " bytes each, only " +
                                std::to_string(Remaining()) + " bytes follow offset " +
                                std::to_string(offset_));
  }
}

}  // namespace retint
