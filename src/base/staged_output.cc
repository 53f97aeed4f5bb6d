// SPDX-License-Identifier: BSD-3-Clause
#include "base/staged_output.h"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <exception>
#include <system_error>
#include <thread>

#include "base/error.h"
#include "base/files.h"
#include "base/input_file.h"
#include "base/input_guard.h"
#include "base/parallel.h"

namespace retint {
namespace {

namespace fs = std::filesystem;

// The path itself or its closest parent that exists.
fs::path NearestExisting(const fs::path& path) {
  std::error_code code;
  fs::path at = fs::absolute(path).lexically_normal();
  while (at.has_relative_path() && !fs::exists(fs::symlink_status(at, code))) {
    at = at.parent_path();
  }
  return at;
}

void CheckFolder(const fs::path& folder, const fs::path& target) {
  std::error_code code;
  if (!fs::is_directory(folder, code)) {
    throw RunError(target.string() + ": cannot write: " + folder.string() + " is not a folder");
  }
  if (access(folder.c_str(), W_OK | X_OK) != 0) {
    throw RunError(target.string() + ": cannot write: " + folder.string() + ": " +
                   std::strerror(errno));
  }
}

fs::path ParentOf(const fs::path& path) {
  return fs::absolute(path).lexically_normal().parent_path();
}

uint64_t DeviceOf(const fs::path& path) {
  struct stat info {};
  return stat(path.c_str(), &info) == 0 ? info.st_dev : 0;
}

// The staged path in a message is of no use to anybody: names the target instead. Of folders also
// the paths below.
[[noreturn]] void RethrowNaming(const RunError& error, const fs::path& staged,
                                const fs::path& target) {
  std::string message = error.what();
  const std::string from = staged.string();
  const size_t at = message.find(from);
  if (at == std::string::npos) throw RunError(message);
  throw RunError(message.replace(at, from.size(), target.string()));
}

}  // namespace

void CheckOutput(const fs::path& path, bool as_folder) {
  if (path.empty()) throw OptionError("an output path is empty");
  std::error_code code;
  const fs::path absolute = fs::absolute(FollowLinks(path)).lexically_normal();
  if (!as_folder) {
    if (!absolute.has_filename() || fs::is_directory(absolute, code)) {
      throw RunError(path.string() + ": cannot write: is a folder");
    }
    if (fs::exists(absolute, code) && !IsFile(absolute)) {
      throw RunError(path.string() + ": cannot write: is not a regular file");
    }
    CheckFolder(NearestExisting(absolute.parent_path()), path);
    return;
  }
  CheckFolder(NearestExisting(absolute), path);
}

void CheckApart(const std::vector<NamedFile>& written, const std::vector<NamedFile>& read) {
  const auto whole = [](const NamedFile& file) {
    std::error_code code;
    const fs::path path = fs::weakly_canonical(FollowLinks(file.path), code);
    return code ? fs::absolute(file.path).lexically_normal() : path;
  };
  for (size_t i = 0; i < written.size(); ++i) {
    const fs::path path = whole(written[i]);
    for (size_t k = 0; k < i; ++k) {
      if (whole(written[k]) != path) continue;
      throw OptionError(written[k].name + " and " + written[i].name + " name one file, " +
                        written[i].path.string());
    }
    for (size_t k = 0; k < i; ++k) {
      const fs::path below = path.lexically_relative(whole(written[k]));
      if (below.empty() || *below.begin() == "..") continue;
      throw OptionError(written[i].name + " lies below " + written[k].name + ", which is a file, " +
                        written[k].path.string());
    }
    for (const NamedFile& other : read) {
      if (whole(other) != path) continue;
      throw OptionError(written[i].name + " would replace what " + other.name + " names, " +
                        written[i].path.string());
    }
  }
}

const StagedOutput::Area& StagedOutput::AreaFor(const fs::path& target) {
  const fs::path anchor = NearestExisting(ParentOf(target));
  for (const Area& area : areas_) {
    if (area.anchor == anchor) return area;
  }
  CheckFolder(anchor, target);
  HiddenFolder hidden(anchor);
  if (hidden.path().empty()) {
    throw RunError(target.string() + ": cannot write: " + std::strerror(errno));
  }
  areas_.push_back({anchor, std::move(hidden)});
  return areas_.back();
}

fs::path StagedOutput::NextSlot(const fs::path& target) {
  return AreaFor(target).hidden.path() / std::to_string(count_++);
}

void StagedOutput::Place(const fs::path& staged, const fs::path& target) {
  const fs::path followed = FollowLinks(target);
  files_.push_back({staged, followed});
  // A rename cannot leave the file system, which a link may do.
  if (DeviceOf(staged.parent_path()) == DeviceOf(NearestExisting(ParentOf(followed)))) return;
  fs::path& copy = files_.back().staged;
  copy = NextSlot(followed) / followed.filename();
  const InputFile from(staged);
  AtomicFile file(copy);
  file.CopyFrom(from.descriptor(), from.size(), [](uint64_t) {});
  file.Commit();
}

void StagedOutput::Add(const fs::path& target, const std::function<void(const fs::path&)>& write) {
  // A folder a file, so that writers see the name (and so the extension) that they were promised.
  const fs::path folder = NextSlot(FollowLinks(target)), staged = folder / target.filename();
  try {
    write(staged);
  } catch (const RunError& error) {
    // Ending with slashes, so that an empty parent stays empty.
    RethrowNaming(error, folder / "", target.parent_path() / "");
  }
  // Files written beside it, or in folders there, go beside it, and first.
  std::error_code code;
  for (const fs::path& path : ListBelow(folder, &code)) {
    if (path == staged || !IsFile(path)) continue;
    Place(path, target.parent_path() / path.lexically_relative(folder));
  }
  if (code) throw RunError(target.string() + ": cannot write: " + code.message());
  Place(staged, target);
}

void StagedOutput::AddFolder(const fs::path& target,
                             const std::function<void(const fs::path&)>& write) {
  const fs::path folder = FollowLinks(target);
  const fs::path staged = NextSlot(folder / "file");
  try {
    std::error_code code;
    if (!fs::create_directory(staged, code) && code) {
      throw RunError(staged.string() + ": cannot write: " + code.message());
    }
    write(staged);
  } catch (const RunError& error) {
    RethrowNaming(error, staged, target);
  }
  std::error_code code;
  for (const fs::path& path : ListBelow(staged, &code)) {
    if (IsFile(path)) Place(path, folder / path.lexically_relative(staged));
  }
  if (code) throw RunError(target.string() + ": cannot write: " + code.message());
}

void StagedOutput::Commit() {
  for (const File& file : files_) {
    InputGuard::Check(file.target);
    CheckOutput(file.target);  // also files beside one that was checked before the work
  }
  for (const File& file : files_) {
    std::error_code code;
    fs::create_directories(ParentOf(file.target), code);
    if (code) {
      throw RunError(file.target.string() + ": cannot create its folder: " + code.message());
    }
    fs::rename(file.staged, file.target, code);
    if (code) throw RunError(file.target.string() + ": cannot write: " + code.message());
  }
  files_.clear();
}

void WriteOnAllCores(size_t count, const std::function<std::function<void()>(size_t)>& make,
                     Monitor& monitor, size_t bytes_each) {
  // Two for each core, so that none waits long for the last.
  const size_t most =
      std::clamp<size_t>((size_t{1} << 30) / std::max<size_t>(bytes_each, 1), 1, 16);
  const size_t batch = std::clamp<size_t>(2 * std::thread::hardware_concurrency(), 1, most);
  for (size_t first = 0; first < count; first += batch) {
    std::vector<std::function<void()>> writes;
    for (size_t i = first; i < std::min(first + batch, count); ++i) {
      monitor.Step("save", static_cast<double>(i), static_cast<double>(count));
      writes.push_back(make(i));
    }
    std::vector<std::exception_ptr> errors(writes.size());
    ParallelTasks(static_cast<int64_t>(writes.size()), [&](int64_t i) {
      const auto at = static_cast<size_t>(i);
      try {
        writes[at]();
      } catch (...) {
        errors[at] = std::current_exception();
      }
    });
    for (const std::exception_ptr& error : errors) {
      if (error) std::rethrow_exception(error);
    }
  }
  monitor.Step("save", 1, 1);
}

}  // namespace retint
