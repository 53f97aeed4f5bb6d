// SPDX-License-Identifier: BSD-3-Clause
#include "base/input_file.h"

#include <fcntl.h>
#include <sys/sendfile.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <system_error>
#include <utility>

#include "base/error.h"
#include "base/input_guard.h"

namespace retint {
namespace {

constexpr size_t kBlockBytes = size_t{1} << 20;

}  // namespace

InputFile::InputFile(std::filesystem::path path, bool is_input) : path_(std::move(path)) {
  if (is_input) InputGuard::NoteRead(path_);
  // O_NONBLOCK: opening a named pipe must not wait for its writer.
  fd_ = open(path_.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (fd_ < 0) throw InputError(path_, std::strerror(errno));
  struct stat info {};
  if (fstat(fd_, &info) != 0 || !S_ISREG(info.st_mode)) {
    close(fd_);
    throw InputError(path_, "not a file");
  }
  size_ = static_cast<uint64_t>(info.st_size);
}

InputFile::~InputFile() { close(fd_); }

void InputFile::ReadAt(uint64_t offset, void* data, size_t bytes) const {
  auto* to = static_cast<char*>(data);
  while (bytes > 0) {
    const ssize_t got = pread(fd_, to, bytes, static_cast<off_t>(offset));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) throw InputError(path_, std::strerror(errno));
    if (got == 0) throw InputError(path_, "truncated: ends at byte " + std::to_string(offset));
    to += got;
    offset += static_cast<uint64_t>(got);
    bytes -= static_cast<size_t>(got);
  }
}

ReadAhead::ReadAhead(const std::filesystem::path& path) {
  try {
    file_ = std::make_unique<const InputFile>(path);
    if (file_->size() <= kBlockBytes) return;
    reader_ = std::thread([this] { Read(); });
  } catch (const InputError&) {
  } catch (const std::system_error&) {  // no more threads
  }
}

ReadAhead::~ReadAhead() {
  stop_ = true;
  if (reader_.joinable()) reader_.join();
}

void ReadAhead::Read() {
  const int file = file_->descriptor();
#ifdef RWF_NOWAIT
  char last;
  const iovec end{&last, 1};
  if (preadv2(file, &end, 1, static_cast<off_t>(file_->size() - 1), RWF_NOWAIT) == 1) return;
#endif
  const int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC);  // without a copy
  for (off_t at = 0; !stop_ && sendfile(nowhere, file, &at, kBlockBytes) > 0;) {
  }
  if (nowhere >= 0) close(nowhere);
}

}  // namespace retint
