// SPDX-License-Identifier: BSD-3-Clause
// Hidden temporary files and folders beside outputs, ".retint-PID-N.tmp". Their maker holds a lock
// on each (flock), which ends with the process. So a later run can tell and remove those that a
// killed run left behind.
#pragma once

#include <filesystem>

namespace retint {

struct HiddenFile {
  std::filesystem::path path;  // empty: it cannot be made, errno says why
  int fd = -1;                 // open for writing; closing it drops the lock
};
// Both makers first remove the leftovers of killed runs in `folder`, once per folder and process.
// They skip a name that exists.
HiddenFile CreateHiddenFile(const std::filesystem::path& folder);

// Removed with everything in it, unless Keep() was called.
class HiddenFolder {
 public:
  // If it cannot be made, path() is empty and errno says why.
  explicit HiddenFolder(const std::filesystem::path& parent);
  ~HiddenFolder();
  HiddenFolder(HiddenFolder&& other) noexcept;
  HiddenFolder& operator=(HiddenFolder&&) = delete;
  const std::filesystem::path& path() const { return path_; }
  void Keep() { path_.clear(); }  // it was renamed

 private:
  std::filesystem::path path_;
  int fd_ = -1;
};

// Removes the hidden files and folders in `folder` that nobody has locked, if their process is not
// alive on this host or they are older than an hour. (A process may have the number of a dead one.
// A file system without locks proves nothing: there they stay.)
void RemoveDeadHidden(const std::filesystem::path& folder);

}  // namespace retint
