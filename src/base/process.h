// SPDX-License-Identifier: BSD-3-Clause
// Other programs, run as children.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "base/monitor.h"

namespace retint {

struct ProcessResult {
  int code = -1;  // exit code; 128 + signal when one ended it
  // The end of its output on stdout and stderr, in the order in which it came: the last lines that
  // are not blank, at most 20.
  std::vector<std::string> last_lines;
};

// The program of that name: a path as it is, a bare name looked up in PATH. Empty if there is no
// such executable file.
std::filesystem::path FindProgram(const std::filesystem::path& name);

// Runs `program` with `arguments` (no shell takes part; nothing is on its stdin) and waits for it.
// `on_line`, where given, sees each line that it prints, on this thread. When the monitor is
// cancelled, the program and its children are ended, first by SIGTERM, after two seconds by
// SIGKILL, and Cancelled is thrown. The same happens when on_line throws. The program also ends
// when this process dies. RunError when it cannot be started.
ProcessResult RunProcess(const std::filesystem::path& program,
                         const std::vector<std::string>& arguments, const Monitor& monitor,
                         const std::function<void(std::string_view line)>& on_line = {});

// A program that answers each line on its stdin with a line on its stdout, for as long as this
// lives. The destructor closes its stdin. If it does not end then, signals end it as above.
class LineProcess {
 public:
  // Runs `command` through sh. RunError when that cannot be started.
  explicit LineProcess(std::string command);
  ~LineProcess();
  LineProcess(const LineProcess&) = delete;
  LineProcess& operator=(const LineProcess&) = delete;

  // Its answer to `line`. RunError, with the last line that it printed on stderr, when it ends or
  // closes its output instead. When the monitor is cancelled, Cancelled is thrown, and the program
  // is of no use any more.
  std::string Ask(const std::string& line, const Monitor& monitor);

 private:
  class State;
  std::unique_ptr<State> state_;
};

}  // namespace retint
