// SPDX-License-Identifier: BSD-3-Clause
// Work that is killed at a moment of the test's choice.
#pragma once

#include <sys/ptrace.h>
#include <sys/syscall.h>
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

// Which stops count.
using StopFilter = std::function<bool(pid_t child)>;

// As a call begins that renames a file.
inline bool IsRename(pid_t child) {
  __ptrace_syscall_info info{};
  if (ptrace(PTRACE_GET_SYSCALL_INFO, child, sizeof info, &info) <= 0) return false;
  if (info.op != PTRACE_SYSCALL_INFO_ENTRY) return false;
#ifdef SYS_rename
  if (info.entry.nr == SYS_rename) return true;
#endif
  return info.entry.nr == SYS_renameat || info.entry.nr == SYS_renameat2;
}

// Runs `work` in a child process, which is killed (SIGKILL) at its `stop`-th stop that counts, from
// 1; 0 lets it run to its end, to count its stops.
inline KilledChild KillAtStop(int stop, const std::function<void()>& work,
                              const StopFilter& counts = {}) {
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
    if (counts && !counts(child)) continue;
    if (++result.stops != stop) continue;
    kill(child, SIGKILL);
    waitpid(child, &status, 0);
    result.killed = true;
    return result;
  }
}

}  // namespace retint
