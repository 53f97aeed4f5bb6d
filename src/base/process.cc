// SPDX-License-Identifier: BSD-3-Clause
#include "base/process.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/socket.h>
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

// Two ends of a connection, closed with it; programs that are started inherit neither.
struct Ends {
  Ends() = default;
  ~Ends() {
    CloseEnd(0);
    CloseEnd(1);
  }
  Ends(const Ends&) = delete;
  Ends& operator=(const Ends&) = delete;
  void CloseEnd(int end) {
    if (ends[end] >= 0) close(std::exchange(ends[end], -1));
  }
  int ends[2] = {-1, -1};
};

struct Pipe : Ends {
  Pipe() {
    if (pipe2(ends, O_CLOEXEC) != 0) throw RunError(std::string("pipe: ") + std::strerror(errno));
  }
};

// A child's stdin, stdout and stderr. Without an input it reads nothing.
struct Streams {
  int input = -1, output, errors;
};

// In the child, between fork and exec: calls that are safe there, nothing else.
[[noreturn]] void Child(const char* program, char* const* argv, pid_t parent,
                        const Streams& streams, int fault) {
  setpgid(0, 0);  // a group of its own, so that all that it starts can be ended with it
  if (streams.input < 0) {
    // With an input, its end says the same. This signal comes when the thread that forked ends.
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent) _exit(127);  // it died before that
  }
  for (const int signal : {SIGINT, SIGTERM, SIGPIPE, SIGXFSZ}) std::signal(signal, SIG_DFL);
  dup2(streams.input < 0 ? open("/dev/null", O_RDONLY) : streams.input, STDIN_FILENO);
  dup2(streams.output, STDOUT_FILENO);
  dup2(streams.errors, STDERR_FILENO);
  execv(program, argv);
  const int code = errno;
  // Nobody listens to a failure to say so.
  [[maybe_unused]] const ssize_t told = write(fault, &code, sizeof(code));
  _exit(127);
}

// A running child. Its group is ended when this goes before Wait().
class Running {
 public:
  // `talks`: it has an input, and an output for errors of its own.
  Running(const fs::path& program, const std::vector<std::string>& arguments, bool talks = false) {
    if (talks && socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, input_.ends) != 0) {
      throw RunError(std::string("socketpair: ") + std::strerror(errno));
    }
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
    if (pid_ == 0) {
      Child(path.c_str(), argv.data(), parent,
            {input_.ends[1], output_.ends[1], talks ? errors_.ends[1] : output_.ends[1]},
            fault.ends[1]);
    }
    setpgid(pid_, pid_);  // also here: whoever comes first
    input_.CloseEnd(1);
    output_.CloseEnd(1);
    errors_.CloseEnd(1);
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

  // Adds its output to `text`; false once it and its children have closed their output. A program
  // that talks has its stderr in `errors`.
  bool Read(std::string& text, std::string* errors = nullptr) {
    pollfd ready[] = {{output_.ends[0], POLLIN, 0}, {errors ? errors_.ends[0] : -1, POLLIN, 0}};
    if (poll(ready, 2, kPollMs) <= 0) return true;
    if (ready[1].revents != 0 && !Take(errors_, errors)) errors_.CloseEnd(0);
    return ready[0].revents == 0 || Take(output_, &text);
  }
  // Adds what it printed on stderr to `errors`; false if there is no more for now.
  bool ReadErrors(std::string* errors) {
    pollfd ready = {errors_.ends[0], POLLIN, 0};
    return poll(&ready, 1, kPollMs) > 0 && Take(errors_, errors);
  }
  // False if it has closed its input, or never reads it.
  bool Write(std::string_view text) {
    const ssize_t sent =
        send(input_.ends[0], text.data(), text.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    return sent == ssize_t(text.size());
  }
  void EndInput() { input_.CloseEnd(0); }
  // Ends it and all that it started. Its exit code, also if it had ended before.
  int End() {
    kill(-pid_, SIGTERM);
    HasEnded(kGraceMs);
    kill(-pid_, SIGKILL);
    return Wait();
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
  static bool Take(const Pipe& pipe, std::string* text) {
    std::array<char, 4096> bytes;
    const ssize_t got = read(pipe.ends[0], bytes.data(), bytes.size());
    if (got > 0) text->append(bytes.data(), size_t(got));
    return got > 0 || (got < 0 && errno == EINTR);
  }

  Ends input_;
  Pipe output_, errors_;
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

class LineProcess::State {
 public:
  explicit State(std::string command)
      : command_(std::move(command)), child_("/bin/sh", {"-c", command_}, /*talks=*/true) {}
  ~State() {
    child_.EndInput();
    if (fault_.empty()) child_.HasEnded(kGraceMs);
  }

  std::string Ask(const std::string& line, const Monitor& monitor) {
    monitor.ThrowIfCancelled();
    if (!fault_.empty()) throw RunError(fault_);
    if (!child_.Write(line + "\n")) Fail();
    while (true) {
      if (const size_t end = text_.find('\n'); end != std::string::npos) {
        std::string answer = text_.substr(0, end);
        text_.erase(0, end + 1);
        if (answer.ends_with('\r')) answer.pop_back();
        return answer;
      }
      // After its end, what it started may hold its output open: a last look is enough.
      const bool ended = child_.HasEnded(0);
      const size_t before = text_.size();
      const bool open = child_.Read(text_, &errors_);
      if (text_.size() > kLongestLine || !open || (ended && text_.size() == before)) Fail();
      // Of the program's messages, the end is enough.
      if (errors_.size() > 2 * kLongestLine) errors_.erase(0, kLongestLine);
      monitor.ThrowIfCancelled();
    }
  }

 private:
  // The last line on stderr that is not blank.
  std::string LastError() {
    for (int i = 0; i < kGraceMs / kPollMs && child_.ReadErrors(&errors_); ++i) continue;
    const size_t last = errors_.find_last_not_of(" \t\r\n");
    if (last == std::string::npos) return "";
    errors_.resize(last + 1);
    return errors_.substr(errors_.find_last_of("\r\n") + 1);  // npos + 1 is 0
  }

  [[noreturn]] void Fail() {
    const bool endless = text_.size() > kLongestLine;
    const bool ended = !endless && child_.HasEnded(kGraceMs);
    const int code = ended ? child_.End() : 0;  // which closes stderr, too
    const std::string error = LastError();
    fault_ = "'" + command_ + "' ";
    if (endless) {
      fault_ += "answered with a line without an end";
    } else if (ended) {
      fault_ += "ended with exit code " + std::to_string(code) + " instead of an answer";
    } else {
      fault_ += "closed its input or output instead of an answer";
    }
    if (!error.empty()) fault_ += ": " + error;
    throw RunError(fault_);
  }

  const std::string command_;
  Running child_;
  std::string text_, errors_;  // printed, and not read as lines yet
  std::string fault_;          // of which it ended
};

LineProcess::LineProcess(std::string command)
    : state_(std::make_unique<State>(std::move(command))) {}

LineProcess::~LineProcess() = default;

std::string LineProcess::Ask(const std::string& line, const Monitor& monitor) {
  return state_->Ask(line, monitor);
}

}  // namespace retint
