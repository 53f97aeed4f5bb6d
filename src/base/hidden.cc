// SPDX-License-Identifier: BSD-3-Clause
#include "base/hidden.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <mutex>
#include <set>
#include <string>
#include <system_error>
#include <utility>

#include "base/files.h"

namespace retint {
namespace {

namespace fs = std::filesystem;

constexpr auto kOld = std::chrono::hours(1);

std::string NextName() {
  static std::atomic<uint64_t> counter{0};
  // Short, so that it fits if the target's own name just does.
  return ".retint-" + std::to_string(getpid()) + "-" + std::to_string(counter++) + ".tmp";
}

// The process that a hidden name names; 0 for other names.
int ProcessOf(const std::string& name) {
  int pid = 0, number = 0, length = 0;
  if (std::sscanf(name.c_str(), ".retint-%d-%d.tmp%n", &pid, &number, &length) != 2) return 0;
  return length > 0 && static_cast<size_t>(length) == name.size() ? pid : 0;
}

bool IsDead(int fd, int pid) {
  if (flock(fd, LOCK_EX | LOCK_NB) != 0) return false;
  if (kill(pid, 0) != 0 && errno == ESRCH) return true;
  struct stat info {};
  if (fstat(fd, &info) != 0) return false;
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return now - std::chrono::seconds(info.st_mtime) > kOld;
}

// Once per process; not in folders that are hidden themselves, which are new.
void SweepOnce(const fs::path& folder) {
  for (const fs::path& part : folder) {
    if (ProcessOf(part.string()) != 0) return;
  }
  static std::mutex mutex;
  static std::set<fs::path> swept;
  static pid_t of = 0;  // a child that was forked is another process
  {
    const std::lock_guard lock(mutex);
    if (std::exchange(of, getpid()) != getpid()) swept.clear();
    if (!swept.insert(fs::absolute(folder.empty() ? "." : folder)).second) return;
  }
  RemoveDeadHidden(folder);
}

// Whether it is still under a name, now that it is locked: between its making and the lock, a sweep
// on another host may have taken it for dead.
bool LockMade(int fd) {
  flock(fd, LOCK_EX);  // fails on file systems without locks; nothing is swept there
  struct stat info {};
  return fstat(fd, &info) != 0 || info.st_nlink > 0;
}

}  // namespace

void RemoveDeadHidden(const fs::path& folder) {
  for (const fs::path& path : ListFolder(folder.empty() ? "." : folder)) {
    const int pid = ProcessOf(path.filename().string());
    if (pid <= 0) continue;
    const int fd = open(path.c_str(), O_RDONLY | O_NONBLOCK | O_NOFOLLOW | O_CLOEXEC);
    if (fd < 0) continue;
    std::error_code ignored;
    if (IsDead(fd, pid)) fs::remove_all(path, ignored);
    close(fd);
  }
}

HiddenFile CreateHiddenFile(const fs::path& folder) {
  SweepOnce(folder);
  for (;;) {
    const fs::path path = folder / NextName();
    const int fd = open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (fd >= 0 && LockMade(fd)) return {path, fd};
    if (fd >= 0) {
      close(fd);
    } else if (errno != EEXIST) {
      return {};
    }
  }
}

HiddenFolder::HiddenFolder(const fs::path& parent) {
  SweepOnce(parent);
  for (;;) {
    const fs::path path = parent / NextName();
    if (mkdir(path.c_str(), 0777) == 0) {
      fd_ = open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
      if (fd_ >= 0 && !LockMade(fd_)) {
        close(fd_);
        continue;
      }
      path_ = path;
      return;
    }
    if (errno != EEXIST) return;
  }
}

HiddenFolder::~HiddenFolder() {
  std::error_code ignored;
  if (!path_.empty()) fs::remove_all(path_, ignored);
  if (fd_ >= 0) close(fd_);
}

HiddenFolder::HiddenFolder(HiddenFolder&& other) noexcept
    : path_(std::exchange(other.path_, {})), fd_(std::exchange(other.fd_, -1)) {}

}  // namespace retint
