// SPDX-License-Identifier: BSD-3-Clause
// Work that is killed at a moment of the test's choice.
#pragma once

#include <sys/ptrace.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <functional>

namespace retint {

struct KilledChild {
  bool allowed = true;  // false: this machine forbids watching a process
  bool killed = false;  // false: it came to its end before
  int stops = 0;        // at system calls: one as a call begins and one as it ends
};

// Runs `work` in a child process, which is killed (SIGKILL) at its `stop`-th stop, from 1; 0 lets
// it run to its end, to count its stops.
inline KilledChild KillAtStop(int stop, const std::function<void()>& work) {
  KilledChild result;
  const pid_t child = fork();
  if (child == 0) {
    if (ptrace(PTRACE_TRACEME, 0, nullptr, nullptr) != 0) _exit(77);
    std::raise(SIGSTOP);
    try {
      work();
    } catch (...) {
      _exit(1);
    }
    _exit(0);
  }
  int status = 0;
  if (child < 0 || waitpid(child, &status, 0) != child || !WIFSTOPPED(status)) {
    result.allowed = false;
    return result;
  }
  ptrace(PTRACE_SETOPTIONS, child, nullptr, PTRACE_O_TRACESYSGOOD | PTRACE_O_EXITKILL);
  int deliver = 0;
  while (true) {
    ptrace(PTRACE_SYSCALL, child, nullptr, deliver);
    if (waitpid(child, &status, 0) != child || !WIFSTOPPED(status)) return result;
    const int signal = WSTOPSIG(status);
    deliver = signal == (SIGTRAP | 0x80) ? 0 : signal;
    if (deliver != 0) continue;
    if (++result.stops != stop) continue;
    kill(child, SIGKILL);
    waitpid(child, &status, 0);
    result.killed = true;
    return result;
  }
}

}  // namespace retint
