// SPDX-License-Identifier: BSD-3-Clause
// Tests of permissions and mounts that run alike for root and for an ordinary user: in a child
// process with the privileges that they need.
#pragma once

#include <fcntl.h>
#include <grp.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <functional>
#include <string>

#include <gtest/gtest.h>

namespace retint {

enum class ChildOutcome { kPassed, kFailed, kNotAllowed };

// Runs `body` in a child process after `prepare` has changed its privileges. Expectations of the
// body are printed as always, and a failed one makes the outcome kFailed. kNotAllowed if `prepare`
// returns false.
inline ChildOutcome RunInChild(const std::function<bool()>& prepare,
                               const std::function<void()>& body) {
  constexpr int kFailed = 1, kNotAllowed = 77;
  std::fflush(nullptr);
  const pid_t child = fork();
  if (child == 0) {
    if (!prepare()) _exit(kNotAllowed);
    try {
      body();
    } catch (const std::exception& error) {
      ADD_FAILURE() << error.what();
    }
    std::fflush(nullptr);
    _exit(testing::Test::HasFailure() ? kFailed : 0);
  }
  int status = 0;
  if (child < 0 || waitpid(child, &status, 0) != child || !WIFEXITED(status)) {
    return ChildOutcome::kFailed;
  }
  if (WEXITSTATUS(status) == kNotAllowed) return ChildOutcome::kNotAllowed;
  return WEXITSTATUS(status) == 0 ? ChildOutcome::kPassed : ChildOutcome::kFailed;
}

// As an ordinary user, whom permissions stop: as the one who runs the tests, or as "nobody" when
// that is root. The body makes its own folders.
inline ChildOutcome RunAsOrdinaryUser(const std::function<void()>& body) {
  constexpr uid_t kNobody = 65534;
  return RunInChild(
      [] {
        return geteuid() != 0 ||
               (setgroups(0, nullptr) == 0 && setgid(kNobody) == 0 && setuid(kNobody) == 0);
      },
      body);
}

// With permission to mount file systems that nobody else sees: in its own mount namespace, for an
// ordinary user in a user namespace too. kNotAllowed if the machine forbids that.
inline ChildOutcome RunWithMounts(const std::function<void()>& body) {
  const auto write = [](const char* path, const std::string& text) {
    const int file = open(path, O_WRONLY | O_CLOEXEC);
    const bool written = ::write(file, text.data(), text.size()) == ssize_t(text.size());
    close(file);
    return written;
  };
  return RunInChild(
      [&] {
        const std::string uid = std::to_string(geteuid()), gid = std::to_string(getegid());
        if (unshare(CLONE_NEWNS) != 0) {
          if (unshare(CLONE_NEWUSER | CLONE_NEWNS) != 0 || !write("/proc/self/setgroups", "deny") ||
              !write("/proc/self/uid_map", "0 " + uid + " 1") ||
              !write("/proc/self/gid_map", "0 " + gid + " 1")) {
            return false;
          }
        }
        return mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0;
      },
      body);
}

}  // namespace retint
