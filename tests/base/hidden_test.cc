// SPDX-License-Identifier: BSD-3-Clause
#include "base/hidden.h"

#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <string>

#include <gtest/gtest.h>

#include "base/files.h"
#include "tests/support/data.h"

namespace retint {
namespace {

namespace fs = std::filesystem;

// The number of a process that has ended.
pid_t DeadProcess() {
  const pid_t child = fork();
  if (child == 0) _exit(0);
  waitpid(child, nullptr, 0);
  return child;
}

std::string NameOf(pid_t pid, int number) {
  return ".retint-" + std::to_string(pid) + "-" + std::to_string(number) + ".tmp";
}

TEST(Hidden, WhatADeadProcessLeftGoes) {
  TempFolder temp;
  const pid_t dead = DeadProcess();
  WriteFile(temp / "deep" / NameOf(dead, 0), "half");
  WriteFile(temp / "deep" / NameOf(dead, 1) / "0/out.ply", "half");
  WriteFile(temp / "deep/.retint-mine.tmp", "somebody's own");
  WriteFile(temp / "deep/out.ply", "old");
  RemoveDeadHidden(temp / "deep");
  EXPECT_EQ(ListFolder(temp / "deep").size(), 2u);
  EXPECT_TRUE(fs::exists(temp / "deep/.retint-mine.tmp"));
  EXPECT_TRUE(fs::exists(temp / "deep/out.ply"));
}

TEST(Hidden, WhatIsBeingWrittenStays) {
  TempFolder temp;
  const HiddenFile file = CreateHiddenFile(temp.path());
  ASSERT_FALSE(file.path.empty());
  const HiddenFolder folder(temp.path());
  ASSERT_FALSE(folder.path().empty());
  // As a process of another host or container sees it, on which ours is not alive.
  const fs::path as_dead = temp / NameOf(DeadProcess(), 0),
                 folder_too = temp / NameOf(DeadProcess(), 1);
  fs::rename(file.path, as_dead);
  fs::rename(folder.path(), folder_too);
  RemoveDeadHidden(temp.path());
  EXPECT_TRUE(fs::exists(as_dead));
  EXPECT_TRUE(fs::exists(folder_too));
  close(file.fd);
  RemoveDeadHidden(temp.path());
  EXPECT_FALSE(fs::exists(as_dead));
  EXPECT_TRUE(fs::exists(folder_too)) << "its maker still has it";
}

// The number of a dead process goes to another one, of whatever program.
TEST(Hidden, OfAProcessThatIsAliveOnlyOldOnesGo) {
  TempFolder temp;
  const fs::path fresh = temp / NameOf(getpid(), 100000), old = temp / NameOf(getpid(), 100001);
  WriteFile(fresh, "half");
  WriteFile(old, "half");
  fs::last_write_time(old, fs::file_time_type::clock::now() - std::chrono::hours(2));
  RemoveDeadHidden(temp.path());
  EXPECT_TRUE(fs::exists(fresh));
  EXPECT_FALSE(fs::exists(old));
}

TEST(Hidden, WritersSweepTheFolderOnce) {
  TempFolder temp;
  const fs::path left = temp / NameOf(DeadProcess(), 0);
  fs::create_directory(left);
  WriteFile(temp / "out.txt", "new");
  EXPECT_FALSE(fs::exists(left));
}

TEST(Hidden, AFolderGoesWithItsObject) {
  TempFolder temp;
  {
    HiddenFolder gone(temp.path()), kept(temp.path());
    WriteFile(gone.path() / "a/b", "text");
    fs::rename(kept.path(), temp / "kept");
    kept.Keep();
  }
  EXPECT_EQ(ListFolder(temp.path()), std::vector{temp / "kept"});
  EXPECT_TRUE(HiddenFolder(temp / "missing").path().empty());
}

}  // namespace
}  // namespace retint
