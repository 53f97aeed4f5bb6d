// SPDX-License-Identifier: BSD-3-Clause
// Runs the real `retint` and keeps its output.
#pragma once

#include <csignal>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace retint {

struct CommandResult {
  int code = -1;  // exit code; 128 + signal when killed by one
  std::string out, err;
};

struct CommandOptions {
  // `recolor` and `refit` print all figures, and `recolor` writes no page unless it is named: it
  // would take half of the time. False: the arguments are all.
  bool adds_flags = true;
  // A program and its arguments that starts `retint`, such as mpirun; found in PATH.
  std::vector<std::string> launcher = {};
  // Called with everything on stderr so far, again and again until it returns true; then the
  // process gets `signal`. May be empty.
  std::function<bool(const std::string& err)> interrupt_when;
  int signal = SIGINT;
  int64_t max_file_bytes = -1;  // RLIMIT_FSIZE: a disk that is full after so much of a file
};

CommandResult RunRetint(const std::vector<std::string>& arguments,
                        const CommandOptions& options = {});

// A tiny sample workspace (160 x 120, 8 views) made by `retint synth`, shared by all tests; never
// written to. Made anew when the executable is newer.
std::filesystem::path TinyWorkspace();
// Its painted view and mask.
std::string TinyView();
std::filesystem::path TinyMask();

// Everything below a folder, sorted, hidden files included.
std::vector<std::string> FilesBelow(const std::filesystem::path& folder);

int CountLines(const std::string& text);

}  // namespace retint
