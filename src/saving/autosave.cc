// SPDX-License-Identifier: BSD-3-Clause
#include "saving/autosave.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <set>
#include <system_error>
#include <utility>

#include "base/error.h"
#include "base/files.h"
#include "saving/session_json.h"

namespace retint {
namespace {

namespace fs = std::filesystem;

constexpr const char* kSuffix = ".retint";
constexpr const char* kMark = ".autosave";

fs::path LockPath(const fs::path& folder) {
  return folder.parent_path() / ("." + folder.filename().string() + ".lock");
}

// The descriptor, or -1 where another program holds it or it cannot be made.
int TakeLock(const fs::path& path) {
  const int fd = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (fd < 0) return -1;
  if (flock(fd, LOCK_EX | LOCK_NB) == 0) {
    // Removed by its owner between the two calls: the name is somebody else's by now.
    struct stat held {
    }, named{};
    if (fstat(fd, &held) == 0 && stat(path.c_str(), &named) == 0 && held.st_ino == named.st_ino) {
      return fd;
    }
  }
  close(fd);
  return -1;
}

bool IsAlive(const fs::path& folder) {
  const fs::path path = LockPath(folder);
  const int fd = open(path.c_str(), O_RDWR | O_CLOEXEC);
  if (fd < 0) return false;
  const bool alive = flock(fd, LOCK_EX | LOCK_NB) != 0;
  close(fd);
  return alive;
}

std::string StemOf(const fs::path& session) {
  const std::string name = session.filename().string();
  return name.ends_with(kSuffix) ? name.substr(0, name.size() - std::string(kSuffix).size()) : name;
}

fs::path Normal(const fs::path& session) {
  const fs::path path = fs::absolute(session).lexically_normal();
  return path.has_filename() ? path : path.parent_path();
}

}  // namespace

fs::path AutosaveDataFolder() {
  const char* data = std::getenv("XDG_DATA_HOME");
  if (data && *data) return fs::path(data) / "retint" / "autosave";
  const char* home = std::getenv("HOME");
  const fs::path base = home && *home ? fs::path(home) : fs::temp_directory_path();
  return base / ".local" / "share" / "retint" / "autosave";
}

bool IsAutosave(const fs::path& folder) {
  const std::string stem = StemOf(Normal(folder));
  const size_t mark = stem.rfind(kMark);
  if (mark == std::string::npos || !Normal(folder).string().ends_with(kSuffix)) return false;
  const std::string number = stem.substr(mark + std::string(kMark).size());
  return number.empty() || (number.size() > 1 && number[0] == '-' &&
                            number.find_first_not_of("0123456789", 1) == std::string::npos);
}

void Autosave::TakeName(const fs::path& session) {
  std::error_code code;
  std::vector<std::pair<fs::path, std::string>> places;
  if (!session.empty()) places.emplace_back(Normal(session).parent_path(), StemOf(Normal(session)));
  const fs::path data = AutosaveDataFolder();
  fs::create_directories(data, code);
  places.emplace_back(data, session.empty() ? "untitled" : StemOf(Normal(session)));
  for (const auto& [place, stem] : places) {
    if (access(place.c_str(), W_OK | X_OK) != 0) continue;
    constexpr int kMost = 1000;
    for (int number = 1; number < kMost; ++number) {
      std::string name = stem + kMark;
      if (number > 1) name.append("-").append(std::to_string(number));
      folder_ = place / (name + kSuffix);
      if (fs::exists(folder_, code)) continue;
      lock_path_ = LockPath(folder_);
      lock_ = TakeLock(lock_path_);
      if (lock_ >= 0) return;
    }
  }
  throw RunError(data.string() + ": cannot write autosaves here");
}

Autosave::Autosave(const fs::path& session, OnWritten on_written)
    : on_written_(std::move(on_written)) {
  TakeName(session);
  writer_ = std::make_unique<SessionWriter>(folder_);
  thread_ = std::thread([this] { Loop(); });
}

Autosave::~Autosave() {
  {
    const std::lock_guard lock(mutex_);
    quit_ = true;
  }
  changed_.notify_all();
  thread_.join();
  std::error_code ignored;
  fs::remove(lock_path_, ignored);
  close(lock_);
}

void Autosave::Submit(SessionSnapshot snapshot) {
  {
    const std::lock_guard lock(mutex_);
    pending_ = std::move(snapshot);
  }
  changed_.notify_all();
}

void Autosave::Flush() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return !pending_ && !busy_; });
}

void Autosave::Discard() {
  std::unique_lock lock(mutex_);
  pending_.reset();
  changed_.wait(lock, [this] { return !busy_; });
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
  writer_ = std::make_unique<SessionWriter>(folder_);
}

std::string Autosave::error() const {
  const std::lock_guard lock(mutex_);
  return error_;
}

void Autosave::Loop() {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] { return pending_ || quit_; });
    if (!pending_) return;
    const SessionSnapshot snapshot = std::move(*pending_);
    pending_.reset();
    busy_ = true;
    lock.unlock();
    std::string error;
    try {
      Monitor monitor;
      writer_->Write(snapshot, monitor);
    } catch (const std::exception& exception) {
      error = exception.what();
    }
    if (on_written_) on_written_(error);
    lock.lock();
    error_ = std::move(error);
    busy_ = false;
    changed_.notify_all();
  }
}

std::vector<Recovery> FindRecoverable(const std::vector<fs::path>& sessions) {
  // The folder to look in, and the start that a name must have.
  std::set<std::pair<fs::path, std::string>> places = {{AutosaveDataFolder(), ""}};
  for (const fs::path& session : sessions) {
    const fs::path path = Normal(session);
    places.emplace(path.parent_path(), StemOf(path) + kMark);
  }
  std::vector<Recovery> found;
  std::set<fs::path> seen;
  for (const auto& [place, start] : places) {
    std::error_code code;
    for (const fs::path& path : ListFolder(place)) {
      const std::string name = path.filename().string();
      const bool ours = name.rfind(start, 0) == 0 && IsAutosave(path);
      if (!ours || !seen.insert(path).second || IsAlive(path)) continue;
      try {
        Recovery recovery;
        recovery.folder = path;
        recovery.info = ReadSessionInfo(path);
        recovery.session = recovery.info.saved;
        recovery.time = fs::last_write_time(path / session_json::kManifest);
        const auto saved = fs::last_write_time(recovery.session / session_json::kManifest, code);
        if (!recovery.session.empty() && !code && saved > recovery.time) continue;
        found.push_back(std::move(recovery));
      } catch (const std::exception&) {
        continue;  // damaged, or gone meanwhile
      }
    }
  }
  std::sort(found.begin(), found.end(),
            [](const Recovery& a, const Recovery& b) { return a.time > b.time; });
  return found;
}

void RemoveRecovery(const Recovery& recovery) {
  if (IsAlive(recovery.folder)) return;
  std::error_code ignored;
  fs::remove_all(recovery.folder, ignored);
  fs::remove(LockPath(recovery.folder), ignored);
}

}  // namespace retint
