// SPDX-License-Identifier: BSD-3-Clause
// The files that a run reads, and those of an open scene: no output replaces one of them.
// ReadFile() and InputFile report the files that they open, AtomicFile and StagedOutput ask. A file
// is known by its path without links, because a rename replaces a name.
#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace retint {

// Its knowledge holds for every output of the process, as long as it lives. Any thread.
class InputGuard {
 public:
  // kReads: also every file that the process reads while this lives.
  enum class Guards { kAdded, kReads };
  explicit InputGuard(Guards guards = Guards::kAdded);
  ~InputGuard();
  InputGuard(const InputGuard&) = delete;
  InputGuard& operator=(const InputGuard&) = delete;

  // An input. OptionError if it has the place of a planned output. A missing file is left out.
  void Add(const std::filesystem::path& file);
  // A splat, and all files that it is made of.
  void AddSplat(const std::filesystem::path& splat,
                const std::vector<std::filesystem::path>& files);
  // An output, before the work begins, and its name in messages. OptionError if it has the place of
  // an input.
  void Plan(const std::string& name, const std::filesystem::path& output);
  // Once they are written.
  void ForgetPlanned();
  // An output that may replace the input in its place: the file itself, or all files of the splat
  // of that path.
  void Allow(const std::filesystem::path& output);
  void AllowSplat(const std::filesystem::path& output);

  // By readers, of each file that they open.
  static void NoteRead(const std::filesystem::path& file);
  // By writers, before they replace `output`: OptionError if it is an input.
  static void Check(const std::filesystem::path& output);

 private:
  bool guards_reads_;
  std::set<std::filesystem::path> inputs_, allowed_;
  std::map<std::filesystem::path, std::set<std::filesystem::path>> splats_;
  std::map<std::filesystem::path, std::string> planned_;
};

}  // namespace retint
