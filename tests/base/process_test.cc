// SPDX-License-Identifier: BSD-3-Clause
#include "base/process.h"

#include <sys/stat.h>

#include <chrono>
#include <csignal>
#include <fstream>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "base/files.h"
#include "tests/support/data.h"

namespace retint {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class ProcessTest : public testing::Test {
 protected:
  // A shell script that can be run.
  std::filesystem::path Script(const std::string& body) {
    const std::filesystem::path path = folder_ / "program.sh";
    WriteFile(path, "#!/bin/sh\n" + body);
    chmod(path.c_str(), 0755);
    return path;
  }
  TempFolder folder_;
  Monitor monitor_;
};

TEST_F(ProcessTest, HandsOverArgumentsAsTheyAre) {
  const auto program = Script("printf '%s\\n' \"$@\"; exit 7\n");
  std::vector<std::string> seen;
  const ProcessResult result =
      RunProcess(program, {"a b", "$HOME; rm x", "--name=\"q\"", "*"}, monitor_,
                 [&](std::string_view line) { seen.emplace_back(line); });
  EXPECT_EQ(result.code, 7);
  EXPECT_THAT(seen, ElementsAre("a b", "$HOME; rm x", "--name=\"q\"", "*"));
  EXPECT_EQ(result.last_lines, seen);
}

TEST_F(ProcessTest, KeepsTheLastLinesOfBothOutputs) {
  const auto program = Script(
      "i=0; while [ $i -lt 50 ]; do i=$((i+1)); echo line $i; done\n"
      "echo; echo '  '; echo fault >&2; printf 'no end of line'\n");
  const ProcessResult result = RunProcess(program, {}, monitor_);
  EXPECT_EQ(result.code, 0);
  ASSERT_EQ(result.last_lines.size(), 20u);
  EXPECT_EQ(result.last_lines.front(), "line 33");
  EXPECT_EQ(result.last_lines[18], "fault");
  EXPECT_EQ(result.last_lines[19], "no end of line");
}

TEST_F(ProcessTest, ReadsNothingAndSeesSignals) {
  EXPECT_EQ(RunProcess(Script("read x && exit 1; exit 0\n"), {}, monitor_).code, 0);
  EXPECT_EQ(RunProcess(Script("kill -TERM $$\n"), {}, monitor_).code, 128 + SIGTERM);
}

TEST_F(ProcessTest, WhatCannotBeStartedIsAnError) {
  for (const std::filesystem::path& path :
       {folder_ / "missing", folder_.path(), std::filesystem::path("/dev/null")}) {
    try {
      RunProcess(path, {}, monitor_);
      ADD_FAILURE() << path << " was run";
    } catch (const RunError& error) {
      EXPECT_THAT(error.what(), HasSubstr(path.string()));
      EXPECT_THAT(error.what(), HasSubstr("cannot be started"));
    }
  }
}

// Waits for a file that a script makes; a loaded machine may take its time.
bool Appears(const std::filesystem::path& path) {
  for (int i = 0; i < 3000 && !std::filesystem::exists(path); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return std::filesystem::exists(path);
}

// A process that has ended but that nobody reaped yet counts as ended.
bool IsRunning(pid_t pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/stat");
  std::string word, state;
  file >> word >> word >> state;
  return file && state != "Z" && state != "X";
}

// A process that is no child of this one cannot be waited for: its adopter reaps it.
bool Ends(pid_t pid) {
  for (int i = 0; i < 1000 && IsRunning(pid); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return !IsRunning(pid);
}

TEST_F(ProcessTest, CancellingEndsItAndWhatItStarted) {
  // It ignores SIGTERM, and so does its own child: both must go all the same.
  const auto program = Script(
      "trap '' TERM\n"
      "sleep 600 &\n"
      "echo $! >" +
      (folder_ / "child").string() + "\n" + "echo $$ >" + (folder_ / "self").string() + "\n" +
      "touch " + (folder_ / "ready").string() + "\nwait\nsleep 600\n");
  std::thread user([&] {
    EXPECT_TRUE(Appears(folder_ / "ready"));
    monitor_.Cancel();
  });
  EXPECT_THROW(RunProcess(program, {}, monitor_), Cancelled);
  user.join();
  for (const char* name : {"self", "child"}) {
    const pid_t pid = pid_t(std::stol(ReadFile(folder_ / name)));
    EXPECT_TRUE(Ends(pid)) << name;
  }
  EXPECT_THROW(RunProcess(program, {}, monitor_), Cancelled) << "not even started";
}

TEST_F(ProcessTest, CanBeCancelledAfterItClosedItsOutput) {
  const auto program =
      Script("touch " + (folder_ / "ready").string() + "\nexec >&- 2>&-\nsleep 600\n");
  std::thread user([&] {
    EXPECT_TRUE(Appears(folder_ / "ready"));
    monitor_.Cancel();
  });
  EXPECT_THROW(RunProcess(program, {}, monitor_), Cancelled);
  user.join();
}

TEST_F(ProcessTest, EndsWhenItsListenerThrows) {
  const auto program = Script("echo $$\nsleep 600\n");
  pid_t pid = 0;
  EXPECT_THROW(RunProcess(program, {}, monitor_,
                          [&](std::string_view line) {
                            pid = pid_t(std::stol(std::string(line)));
                            throw InputError("enough");
                          }),
               InputError);
  EXPECT_FALSE(IsRunning(pid));
}

TEST_F(ProcessTest, FindsProgramsAsAShellDoes) {
  EXPECT_EQ(FindProgram("sh").filename(), "sh");
  EXPECT_TRUE(FindProgram("sh").is_absolute());
  EXPECT_EQ(FindProgram("retint-no-such-program"), "");
  EXPECT_EQ(FindProgram(""), "");
  const auto program = Script("exit 0\n");
  EXPECT_EQ(FindProgram(program), program);
  chmod(program.c_str(), 0644);
  EXPECT_EQ(FindProgram(program), "") << "it is not executable";
  EXPECT_EQ(FindProgram(folder_.path()), "");
}

TEST_F(ProcessTest, LinesAreAnsweredInTurnAndErrorsKeptApart) {
  LineProcess program("while read line; do echo \"heard $line\"; echo noise >&2; done");
  EXPECT_EQ(program.Ask("one", monitor_), "heard one");
  EXPECT_EQ(program.Ask("two words", monitor_), "heard two words");
}

TEST_F(ProcessTest, AProgramThatEndsInsteadOfAnAnswerSaysWhyOnceAndForAll) {
  LineProcess program("read line; echo first >&2; echo last >&2; exit 5");
  for (int i = 0; i < 2; ++i) {
    try {
      program.Ask("hello", monitor_);
      ADD_FAILURE() << "it answered";
    } catch (const RunError& error) {
      EXPECT_THAT(error.what(), HasSubstr("ended with exit code 5 instead of an answer: last"));
    }
  }
}

TEST_F(ProcessTest, ItsEndIsNoticedAlthoughItsChildHoldsItsOutput) {
  const std::string child = (folder_ / "child").string();
  LineProcess program("read line; sleep 600 & echo $! >" + child + "; echo gone >&2; exit 5");
  try {
    program.Ask("hello", monitor_);
    ADD_FAILURE() << "it answered";
  } catch (const RunError& error) {
    EXPECT_THAT(error.what(), HasSubstr("ended with exit code 5 instead of an answer: gone"));
  }
  const pid_t pid = pid_t(std::stol(ReadFile(child)));
  EXPECT_TRUE(Ends(pid)) << "its child ends with it";
}

TEST_F(ProcessTest, EndsWithItsInputAndIsKilledIfItDoesNot) {
  { LineProcess("cat >/dev/null; touch " + (folder_ / "ended").string()); }
  EXPECT_TRUE(std::filesystem::exists(folder_ / "ended"));
  const std::string self = (folder_ / "self").string();
  {
    LineProcess program("trap '' TERM; echo $$ >" + self + "; echo up; while :; do sleep 1; done");
    EXPECT_EQ(program.Ask("", monitor_), "up");
  }
  EXPECT_FALSE(IsRunning(pid_t(std::stol(ReadFile(self)))));
}

}  // namespace
}  // namespace retint
