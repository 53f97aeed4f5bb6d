// SPDX-License-Identifier: BSD-3-Clause
// Every reader of files that nobody vouches for, as a function of the file's bytes. Each either
// reads them or throws one of our errors (base/error.h): anything else is a fault. libFuzzer drives
// them (fuzz_one.cc), and so does a test (fuzz_test.cc).
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace retint {

struct FuzzTarget {
  const char* name;  // "spz"
  const char* file;  // the name that the reader sees, in a folder of its own
  // Reads `folder`/`file`. `prepare` has put the reader's other files into `folder`.
  void (*read)(const std::filesystem::path& folder);
  // Called once a folder; may be null.
  void (*prepare)(const std::filesystem::path& folder);
  // Small whole files to start from.
  std::vector<std::string> (*seeds)();
  // Other people's files below the folder of test data that are seeds too, where it is there.
  std::vector<const char*> data;
};

// Of splat files and of COLMAP workspaces.
std::span<const FuzzTarget> ReaderTargets();
// Of selections, edits, jobs and sessions.
std::span<const FuzzTarget> SessionTargets();

// Writes `bytes` as the target's file below `folder`, which was prepared, and reads it. Bad bytes
// get our own errors. All other exceptions reach the caller.
void RunTarget(const FuzzTarget& target, const std::filesystem::path& folder,
               std::string_view bytes);

}  // namespace retint
