// SPDX-License-Identifier: BSD-3-Clause
#include "base/process.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <system_error>
#include <utility>

#include "base/error.h"

namespace retint {
namespace {

namespace fs = std::filesystem;

constexpr size_t kLastLines = 20;
constexpr size_t kLongestLine = 4096;  // bytes; longer output is taken in pieces
constexpr int kPollMs = 50;            // how long a cancellation may go unseen
constexpr int kGraceMs = 2000;

// The two ends of a pipe, closed with it; programs that are started inherit neither.
struct Pipe {
  Pipe() {
    if (pipe2(ends, O_CLOEXEC) != 0) throw RunError(std::string("pipe: ") + std::strerror(errno));
  }
  ~Pipe() {
    CloseEnd(0);
    CloseEnd(1);
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;
  void CloseEnd(int end) {
    if (ends[end] >= 0) close(std::exchange(ends[end], -1));
  }
  int ends[2] = {-1, -1};
};

// In the child, between fork and exec: calls that are safe there, nothing else.
[[noreturn]] void Child(const char* program, char* const* argv, pid_t parent, int output,
                        int fault) {
  setpgid(0, 0);  // a group of its own, so that all that it starts can be ended with it
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(127);  // it died before that
  for (const int signal : {SIGINT, SIGTERM, SIGPIPE, SIGXFSZ}) std::signal(signal, SIG_DFL);
  const int nothing = open("/dev/null", O_RDONLY);
  dup2(nothing, STDIN_FILENO);
  dup2(output, STDOUT_FILENO);
  dup2(output, STDERR_FILENO);
  execv(program, argv);
  const int code = errno;
  // Nobody listens to a failure to say so.
  [[maybe_unused]] const ssize_t told = write(fault, &code, sizeof(code));
  _exit(127);
}

// A running child. Its group is ended when this goes before Wait().
class Running {
 public:
  Running(const fs::path& program, const std::vector<std::string>& arguments) {
    const std::string path = program.string();
    std::vector<char*> argv = {const_cast<char*>(path.c_str())};
    for (const std::string& argument : arguments) {
      argv.push_back(const_cast<char*>(argument.c_str()));
    }
    argv.push_back(nullptr);
    Pipe fault;
    const pid_t parent = getpid();
    pid_ = fork();
    if (pid_ < 0) throw RunError(path + ": cannot be started: " + std::strerror(errno));
    if (pid_ == 0) Child(path.c_str(), argv.data(), parent, output_.ends[1], fault.ends[1]);
    setpgid(pid_, pid_);  // also here: whoever comes first
    output_.CloseEnd(1);
    fault.CloseEnd(1);
    int code = 0;
    ssize_t got = 0;
    while ((got = read(fault.ends[0], &code, sizeof(code))) < 0 && errno == EINTR) continue;
    if (got > 0) {
      Wait();
      throw RunError(path + ": cannot be started: " + std::strerror(code));
    }
  }
  ~Running() {
    if (pid_ > 0) End();
  }
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;

  // Adds its output to `text`; false once it and its children have closed their output.
  bool Read(std::string& text) {
    pollfd ready{output_.ends[0], POLLIN, 0};
    if (poll(&ready, 1, kPollMs) <= 0) return true;
    std::array<char, 4096> bytes;
    const ssize_t got = read(output_.ends[0], bytes.data(), bytes.size());
    if (got > 0) text.append(bytes.data(), size_t(got));
    return got > 0 || (got < 0 && errno == EINTR);
  }
  // Whether it has ended, within `timeout_ms`. It is not reaped yet, so its number names no other.
  bool HasEnded(int timeout_ms) const {
    for (int waited = 0;; waited += 10) {
      siginfo_t info{};
      if (waitid(P_PID, id_t(pid_), &info, WEXITED | WNOHANG | WNOWAIT) == 0 && info.si_pid != 0) {
        return true;
      }
      if (waited >= timeout_ms) return false;
      poll(nullptr, 0, 10);
    }
  }
  int Wait() {
    int status = 0;
    while (waitpid(pid_, &status, 0) < 0 && errno == EINTR) continue;
    pid_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }

 private:
  void End() {
    kill(-pid_, SIGTERM);
    HasEnded(kGraceMs);
    kill(-pid_, SIGKILL);
    Wait();
  }

  Pipe output_;
  pid_t pid_ = -1;
};

}  // namespace

fs::path FindProgram(const fs::path& name) {
  const auto executable = [](const fs::path& path) {
    std::error_code code;
    return fs::is_regular_file(path, code) && access(path.c_str(), X_OK) == 0;
  };
  if (name.empty()) return {};
  if (name.has_parent_path()) return executable(name) ? name : fs::path();
  const char* folders = std::getenv("PATH");
  std::string_view rest = folders ? folders : "";
  while (!rest.empty()) {
    const size_t length = std::min(rest.find(':'), rest.size());
    const fs::path candidate = fs::path(rest.substr(0, length)) / name;
    if (length > 0 && executable(candidate)) return candidate;
    rest.remove_prefix(std::min(length + 1, rest.size()));
  }
  return {};
}

ProcessResult RunProcess(const fs::path& program, const std::vector<std::string>& arguments,
                         const Monitor& monitor,
                         const std::function<void(std::string_view)>& on_line) {
  monitor.ThrowIfCancelled();
  Running child(program, arguments);
  ProcessResult result;
  const auto take = [&](std::string_view line) {
    while (!line.empty() && std::strchr(" \t\r", line.back())) line.remove_suffix(1);
    if (line.empty()) return;
    if (result.last_lines.size() == kLastLines) {
      result.last_lines.erase(result.last_lines.begin());
    }
    result.last_lines.emplace_back(line);
    if (on_line) on_line(line);
  };
  std::string text;
  bool open = true;
  while (open) {
    open = child.Read(text);
    monitor.ThrowIfCancelled();
    for (size_t end; (end = text.find('\n')) != std::string::npos; text.erase(0, end + 1)) {
      take(std::string_view(text).substr(0, end));
    }
    if (text.size() > kLongestLine) {
      take(text);
      text.clear();
    }
  }
  take(text);
  while (!child.HasEnded(kPollMs)) monitor.ThrowIfCancelled();
  result.code = child.Wait();
  return result;
}

}  // namespace retint
