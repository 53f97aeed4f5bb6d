// SPDX-License-Identifier: BSD-3-Clause
#include "tests/e2e/command.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdlib>
#include <stdexcept>

namespace retint {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void Child(const std::vector<std::string>& arguments, const CommandOptions& options,
                        int out, int err) {
  dup2(out, STDOUT_FILENO);
  dup2(err, STDERR_FILENO);
  if (options.max_file_bytes >= 0) {
    const auto limit = static_cast<rlim_t>(options.max_file_bytes);
    const rlimit both{limit, limit};
    setrlimit(RLIMIT_FSIZE, &both);
  }
  std::vector<char*> argv;
  for (const std::string& word : options.launcher) argv.push_back(const_cast<char*>(word.c_str()));
  argv.push_back(const_cast<char*>(RETINT_EXECUTABLE));
  for (const std::string& argument : arguments) {
    argv.push_back(const_cast<char*>(argument.c_str()));
  }
  argv.push_back(nullptr);
  setenv("RETINT_CACHE", "", 0);  // do not test results of an older program
  execvp(argv.front(), argv.data());
  _exit(127);
}

// Appends the available text; false at the end of the file.
bool ReadSome(int fd, std::string& text) {
  std::array<char, 4096> bytes;
  const ssize_t got = read(fd, bytes.data(), bytes.size());
  if (got <= 0) return false;
  text.append(bytes.data(), static_cast<size_t>(got));
  return true;
}

}  // namespace

namespace {

std::vector<std::string> WithFlags(std::vector<std::string> arguments) {
  const std::string verb = arguments.empty() ? "" : arguments[0];
  if (verb != "recolor" && verb != "refit") return arguments;
  const auto has = [&](const char* flag) { return std::ranges::count(arguments, flag) > 0; };
  if (verb == "recolor" && !has("--report-html") && !has("--help") && !has("-h")) {
    arguments.push_back("--no-report-html");
  }
  arguments.push_back("--verbose");
  return arguments;
}

}  // namespace

CommandResult RunRetint(const std::vector<std::string>& typed, const CommandOptions& options) {
  const std::vector<std::string> arguments = options.adds_flags ? WithFlags(typed) : typed;
  int out[2], err[2];
  if (pipe2(out, O_CLOEXEC) != 0 || pipe2(err, O_CLOEXEC) != 0) throw std::runtime_error("pipe");
  const pid_t pid = fork();
  if (pid < 0) throw std::runtime_error("fork");
  if (pid == 0) Child(arguments, options, out[1], err[1]);
  close(out[1]);
  close(err[1]);
  CommandResult result;
  bool out_open = true, err_open = true, signalled = !options.interrupt_when;
  while (out_open || err_open) {
    pollfd both[2] = {{out_open ? out[0] : -1, POLLIN, 0}, {err_open ? err[0] : -1, POLLIN, 0}};
    poll(both, 2, -1);
    if (both[0].revents != 0) out_open = ReadSome(out[0], result.out);
    if (both[1].revents != 0) err_open = ReadSome(err[0], result.err);
    if (!signalled && options.interrupt_when(result.err)) {
      kill(pid, options.signal);
      signalled = true;
    }
  }
  close(out[0]);
  close(err[0]);
  int status = 0;
  waitpid(pid, &status, 0);
  result.code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return result;
}

fs::path TinyWorkspace() {
  const fs::path folder = fs::path(RETINT_E2E_FOLDER) / "workspace";
  // Tests run side by side in processes of their own: one makes it, the others wait.
  const int lock = open((folder.string() + ".lock").c_str(), O_CREAT | O_RDWR | O_CLOEXEC, 0666);
  flock(lock, LOCK_EX);
  std::error_code code;
  const auto made = fs::last_write_time(folder / "splat.ply", code);
  if (code || made < fs::last_write_time(RETINT_EXECUTABLE)) {
    fs::remove_all(folder);
    const CommandResult result = RunRetint({"synth", "--output", folder.string(), "--width", "160",
                                            "--height", "120", "--photos", "8", "--quiet"});
    if (result.code != 0) throw std::runtime_error("retint synth failed: " + result.err);
  }
  close(lock);
  return folder;
}

fs::path TinyMask() {
  for (const auto& entry : fs::directory_iterator(TinyWorkspace() / "masks")) return entry.path();
  throw std::runtime_error("the sample workspace has no mask");
}

std::string TinyView() { return TinyMask().stem().string(); }

std::vector<std::string> FilesBelow(const fs::path& folder) {
  std::vector<std::string> names;
  if (!fs::exists(folder)) return names;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    names.push_back(entry.path().lexically_relative(folder).string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

int CountLines(const std::string& text) {
  return static_cast<int>(std::count(text.begin(), text.end(), '\n'));
}

}  // namespace retint
