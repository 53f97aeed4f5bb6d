// SPDX-License-Identifier: BSD-3-Clause
// Several output files, none of which is put in place before all are written.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "base/hidden.h"
#include "base/monitor.h"

namespace retint {

// Cheap checks before long work: RunError naming `path` if it cannot be written as a file (or,
// `as_folder`, as a folder of files). Reasons are a folder or file in its place, a parent that is a
// file, and no permission. Creates nothing.
void CheckOutput(const std::filesystem::path& path, bool as_folder = false);

// A file of a command or a job, and its name there.
struct NamedFile {
  std::string name;
  std::filesystem::path path;
};
// OptionError if two of the `written` are one file, also by different paths, or if one is among the
// `read`. Also if one lies below an earlier one; the last one may be a folder.
void CheckApart(const std::vector<NamedFile>& written, const std::vector<NamedFile>& read);

// Files go to a hidden folder beside their targets (same file system) and are renamed into place by
// Commit(); without it the destructor removes them and every folder that was created. So a full
// disk or a cancelled save changes nothing. A target that is a link is followed. OptionError,
// before anything is in place, if a target is an input (base/input_guard.h).
//
// Each file is in place as a whole or not at all, but not all files together. If the program is
// killed during Commit(), the first files are new and the rest are old. Files beside a target come
// before it. Commit() does as CheckOutput() for each file before it places the first.
class StagedOutput {
 public:
  StagedOutput() = default;
  StagedOutput(const StagedOutput&) = delete;
  StagedOutput& operator=(const StagedOutput&) = delete;

  // Calls `write` with the path to write to instead of `target`. A RunError it throws is rethrown
  // naming `target`.
  void Add(const std::filesystem::path& target,
           const std::function<void(const std::filesystem::path& staged)>& write);
  // Adds, below the folder `target`, whatever `write` leaves below the folder it is given.
  void AddFolder(const std::filesystem::path& target,
                 const std::function<void(const std::filesystem::path& staged)>& write);
  void Commit();
  bool IsEmpty() const { return count_ == 0; }  // nothing was added

 private:
  struct Area {
    std::filesystem::path anchor;  // existing folder that holds the hidden one
    HiddenFolder hidden;
  };
  struct File {
    std::filesystem::path staged, target;
  };
  const Area& AreaFor(const std::filesystem::path& target);
  std::filesystem::path NextSlot(const std::filesystem::path& target);
  void Place(const std::filesystem::path& staged, const std::filesystem::path& target);

  std::vector<Area> areas_;
  std::vector<File> files_;
  size_t count_ = 0;
};

// Writes `count` files whose encoding takes most of the time. Calls make(i) for every i in order on
// this thread; before each it reports "save", and may be cancelled. The functions that make()
// returns run on all cores, so many at a time that they hold at most 1 GiB: `bytes_each`. Throws
// the first error in the order of the files; files before and after it may have been written.
void WriteOnAllCores(size_t count, const std::function<std::function<void()>(size_t i)>& make,
                     Monitor& monitor, size_t bytes_each = size_t{25} << 20);

}  // namespace retint
