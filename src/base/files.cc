// SPDX-License-Identifier: BSD-3-Clause
#include "base/files.h"

#include <fcntl.h>
#include <linux/fs.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>

#include "base/hidden.h"
#include "base/input_guard.h"

namespace retint {
namespace {

template <typename Iterator>
std::vector<std::filesystem::path> List(const std::filesystem::path& folder,
                                        std::error_code* error) {
  std::vector<std::filesystem::path> paths;
  std::error_code code;
  // A range-for would throw where reading fails on the way.
  for (Iterator entry(folder, code); !code && entry != Iterator(); entry.increment(code)) {
    paths.push_back(entry->path());
  }
  if (error) *error = code;
  return paths;
}

constexpr size_t kBufferBytes = size_t{1} << 20;

}  // namespace

bool IsFile(const std::filesystem::path& path) {
  std::error_code code;
  return std::filesystem::is_regular_file(path, code);
}

bool IsFolder(const std::filesystem::path& path) {
  std::error_code code;
  return std::filesystem::is_directory(path, code);
}

std::vector<std::filesystem::path> ListFolder(const std::filesystem::path& folder,
                                              std::error_code* error) {
  return List<std::filesystem::directory_iterator>(folder, error);
}

std::vector<std::filesystem::path> ListBelow(const std::filesystem::path& folder,
                                             std::error_code* error) {
  return List<std::filesystem::recursive_directory_iterator>(folder, error);
}

std::string ReadFile(const std::filesystem::path& path) {
  InputGuard::NoteRead(path);
  // Not blocking: a pipe without a writer is refused below, not waited for.
  const int fd = open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (fd < 0) throw InputError(path, std::strerror(errno));
  struct stat info {};
  std::string bytes;
  const bool is_file = fstat(fd, &info) == 0 && S_ISREG(info.st_mode);
  size_t done = 0;
  ssize_t got = is_file ? 1 : -1;
  if (is_file) {
    try {
      bytes.resize(static_cast<size_t>(info.st_size));
    } catch (const std::exception&) {
      close(fd);
      throw InputError(path, "does not fit into memory");
    }
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

std::filesystem::path FollowLinks(const std::filesystem::path& path) {
  namespace fs = std::filesystem;
  constexpr int kMostLinks = 40;  // as Linux
  fs::path at = path;
  std::error_code code;
  // Of an open pipe, as /dev/stdout is, the link is no path.
  const fs::file_status status = fs::status(path, code);
  const bool is_other =
      fs::exists(status) && !fs::is_regular_file(status) && !fs::is_directory(status);
  for (int i = 0; i < kMostLinks; ++i) {
    if (is_other || !fs::is_symlink(fs::symlink_status(at, code))) return at;
    at = at.parent_path() / fs::read_symlink(at, code);  // an absolute one as it is
    if (code) break;
  }
  throw RunError(path.string() + ": cannot write: a link that leads nowhere");
}

AtomicFile::AtomicFile(std::filesystem::path path) : path_(FollowLinks(path)) {
  namespace fs = std::filesystem;
  std::error_code code;
  InputGuard::Check(path_);
  // Renaming over a device would replace it by a file.
  const fs::file_status status = fs::status(path_, code);
  if (fs::is_directory(status)) throw RunError(path_.string() + ": is a folder");
  if (fs::exists(status) && !fs::is_regular_file(status)) {
    throw RunError(path_.string() + ": is not a regular file");
  }
  CreateFolders();
  HiddenFile hidden = CreateHiddenFile(path_.parent_path());
  temporary_ = std::move(hidden.path);
  fd_ = hidden.fd;
  if (fd_ < 0) {
    const int reason = errno;
    RemoveCreatedFolders();
    errno = reason;
    Fail("cannot write");
  }
  buffer_.reserve(kBufferBytes);
}

AtomicFile::~AtomicFile() {
  if (fd_ >= 0) {
    close(fd_);
    unlink(temporary_.c_str());
    RemoveCreatedFolders();
  }
}

void AtomicFile::CreateFolders() {
  namespace fs = std::filesystem;
  std::error_code code;
  for (fs::path folder = path_.parent_path(); !folder.empty() && !fs::exists(folder, code);
       folder = folder.parent_path()) {
    created_folders_.push_back(folder);
  }
  if (!path_.has_parent_path()) return;
  fs::create_directories(path_.parent_path(), code);
  if (code) {
    RemoveCreatedFolders();
    throw RunError(path_.string() + ": cannot create its folder: " + code.message());
  }
}

void AtomicFile::RemoveCreatedFolders() {
  // rmdir refuses a folder that something else was put into meanwhile.
  for (const auto& folder : created_folders_) rmdir(folder.c_str());
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

void AtomicFile::CopyFrom(int file, uint64_t bytes,
                          const std::function<void(uint64_t done)>& report) {
  constexpr uint64_t kPart = uint64_t{64} << 20;  // between two reports
  const auto fail_short = [&] {
    throw RunError(path_.string() + ": what is to be copied into it became shorter");
  };
  struct stat info {};
  if (fstat(file, &info) != 0) Fail("cannot read what is to be copied into it");
  if (static_cast<uint64_t>(info.st_size) < bytes) fail_short();
  if (ioctl(fd_, FICLONE, file) == 0) {
    if (ftruncate(fd_, static_cast<off_t>(bytes)) != 0) Fail("cannot write");
    if (lseek(fd_, 0, SEEK_END) < 0) Fail("cannot write");
    return report(bytes);
  }
  std::vector<char> part;  // where the kernel cannot copy between these two
  for (uint64_t done = 0; done < bytes;) {
    report(done);
    const uint64_t wanted = std::min(kPart, bytes - done);
    auto from = static_cast<off_t>(done);
    ssize_t got = part.empty() ? copy_file_range(file, &from, fd_, nullptr, wanted, 0) : -1;
    if (got < 0 && part.empty()) {
      if (errno == EINTR) continue;
      if (errno == ENOSPC || errno == EFBIG || errno == EDQUOT || errno == EIO)
        Fail("cannot write");
      part.resize(kBufferBytes);
    }
    if (!part.empty()) {
      got = pread(file, part.data(), std::min<uint64_t>(part.size(), wanted), from);
      if (got < 0 && errno == EINTR) continue;
      if (got > 0) {
        Write(part.data(), static_cast<size_t>(got));
        Flush();
      }
    }
    if (got < 0) Fail("cannot read what is to be copied into it");
    if (got == 0) fail_short();
    done += static_cast<uint64_t>(got);
  }
}

void AtomicFile::WriteAt(uint64_t offset, const void* data, size_t bytes) {
  Flush();
  const auto* from = static_cast<const char*>(data);
  while (bytes > 0) {
    const ssize_t wrote = pwrite(fd_, from, bytes, static_cast<off_t>(offset));
    if (wrote < 0 && errno == EINTR) continue;
    if (wrote < 0) Fail("cannot write");
    from += wrote;
    offset += static_cast<uint64_t>(wrote);
    bytes -= static_cast<size_t>(wrote);
  }
}

void AtomicFile::Sync() {
  Flush();
  if (fsync(fd_) != 0) Fail("cannot write");
}

void AtomicFile::Commit() {
  Sync();
  InputGuard::Check(path_);
  if (rename(temporary_.c_str(), path_.c_str()) != 0) Fail("cannot write");
  close(fd_);
  fd_ = -1;
}

void WriteFile(const std::filesystem::path& path, std::string_view bytes) {
  AtomicFile file(path);
  file.Write(bytes);
  file.Commit();
}

void ByteReader::Require(uint64_t count, uint64_t min_bytes, std::string_view what) const {
  if (min_bytes == 0 || count <= Remaining() / min_bytes) return;
  const std::string needed =
      count == 1 ? std::string(what) + " needs " + std::to_string(min_bytes) + " bytes"
                 : std::to_string(count) + " " + std::string(what) + " need " +
                       std::to_string(min_bytes) + " bytes each";
  throw InputError(path_, "truncated: " + needed + ", only " + std::to_string(Remaining()) +
                              " bytes follow offset " + std::to_string(offset_));
}

}  // namespace retint
