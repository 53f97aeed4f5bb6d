// SPDX-License-Identifier: BSD-3-Clause
#include "base/stage_cache.h"

#include <sys/wait.h>
#include <unistd.h>

#include <gtest/gtest.h>

#include "base/error.h"
#include "base/files.h"
#include "tests/support/data.h"
#include "tests/support/privileges.h"

namespace retint {
namespace {

namespace fs = std::filesystem;

std::string KeyOf(std::initializer_list<std::string_view> parts) {
  StageKey key("stage");
  for (const std::string_view part : parts) key.Add(part);
  return key.Hex();
}

TEST(StageKey, TellsPartsApart) {
  EXPECT_EQ(KeyOf({"ab", "c"}), KeyOf({"ab", "c"}));
  EXPECT_NE(KeyOf({"ab", "c"}), KeyOf({"a", "bc"}));
  EXPECT_NE(KeyOf({"ab"}), KeyOf({"ab", ""}));
  EXPECT_EQ(KeyOf({}).size(), 32u);
  EXPECT_NE(KeyOf({}).substr(0, 16), KeyOf({}).substr(16)) << "the two halves are independent";
}

class Cache : public testing::Test {
 protected:
  void Put(StageCache& cache, const std::string& key, const std::string& text) {
    cache.Write("select", key, [&](const fs::path& folder) { WriteFile(folder / "text", text); });
  }
  std::string Get(StageCache& cache, const std::string& key) {
    std::string text = "nothing";
    cache.Read("select", key, [&](const fs::path& folder) { text = ReadFile(folder / "text"); });
    return text;
  }

  TempFolder temp_;
  const std::string a_ = KeyOf({"a"}), b_ = KeyOf({"b"});
};

TEST_F(Cache, GivesBackWhatWasPutThere) {
  StageCache cache(temp_ / "cache");
  EXPECT_FALSE(cache.Has("select", a_));
  Put(cache, a_, "one");
  EXPECT_TRUE(cache.Has("select", a_));
  EXPECT_FALSE(cache.Has("project", a_));
  EXPECT_EQ(Get(cache, a_), "one");
  EXPECT_EQ(Get(cache, b_), "nothing");
}

TEST_F(Cache, AWriteThatFailsLeavesNothing) {
  StageCache cache(temp_ / "cache");
  EXPECT_THROW(cache.Write("select", a_,
                           [](const fs::path& folder) {
                             WriteFile(folder / "half", "half");
                             throw Cancelled();
                           }),
               Cancelled);
  EXPECT_FALSE(cache.Has("select", a_));
  EXPECT_TRUE(fs::is_empty(temp_ / "cache"));
}

TEST_F(Cache, ADamagedEntryIsRemoved) {
  StageCache cache(temp_ / "cache");
  Put(cache, a_, "one");
  EXPECT_FALSE(cache.Read("select", a_,
                          [](const fs::path& folder) { throw InputError(folder, "is damaged"); }));
  EXPECT_FALSE(cache.Has("select", a_));
}

TEST_F(Cache, WithoutAFolderNothingIsKept) {
  StageCache cache("");
  Put(cache, a_, "one");
  EXPECT_EQ(Get(cache, a_), "nothing");
}

TEST_F(Cache, TheEntriesUsedLongestAgoGoFirst) {
  const std::string c = KeyOf({"c"});
  {
    StageCache earlier(temp_ / "cache");
    Put(earlier, a_, std::string(1000, 'a'));
    Put(earlier, b_, std::string(1000, 'b'));
    Put(earlier, c, std::string(1000, 'c'));
  }
  WriteFile(temp_ / "cache" / "mine.txt", "somebody's own file");
  const auto now = fs::file_time_type::clock::now();
  using std::chrono::hours;
  fs::last_write_time(temp_ / "cache" / ("select-" + a_), now - hours(3));
  fs::last_write_time(temp_ / "cache" / ("select-" + b_), now - hours(2));
  fs::last_write_time(temp_ / "cache" / ("select-" + c), now - hours(1));
  StageCache cache(temp_ / "cache");
  EXPECT_NE(Get(cache, a_), "nothing");  // used now
  cache.Trim(2500);
  EXPECT_TRUE(cache.Has("select", a_));
  EXPECT_FALSE(cache.Has("select", b_));
  EXPECT_TRUE(cache.Has("select", c));
  cache.Trim(0);
  EXPECT_TRUE(cache.Has("select", a_)) << "this run needs it";
  EXPECT_FALSE(cache.Has("select", c));
  EXPECT_TRUE(IsFile(temp_ / "cache" / "mine.txt"));
}

TEST_F(Cache, WhatAKilledRunLeftGoes) {
  const pid_t dead = fork();
  if (dead == 0) _exit(0);
  waitpid(dead, nullptr, 0);
  const fs::path left = temp_ / "cache" / (".retint-" + std::to_string(dead) + "-0.tmp");
  WriteFile(left / "text", "half");
  StageCache cache(temp_ / "cache");
  Put(cache, a_, "one");
  EXPECT_FALSE(fs::exists(left));
  EXPECT_TRUE(cache.Has("select", a_));
}

TEST_F(Cache, AnEntryThatCannotBeReadDoesNotStopTheOthers) {
  const ChildOutcome outcome = RunAsOrdinaryUser([this] {
    const TempFolder folder;
    {
      StageCache earlier(folder / "cache");
      Put(earlier, a_, "one");
      Put(earlier, b_, "two");
    }
    const fs::path locked = folder / ("cache/select-" + a_) / "locked";
    fs::create_directory(locked);
    fs::permissions(locked, fs::perms::none);
    StageCache cache(folder / "cache");
    cache.Trim(0);
    EXPECT_FALSE(cache.Has("select", b_));
    fs::permissions(locked, fs::perms::owner_all);
  });
  EXPECT_EQ(outcome, ChildOutcome::kPassed);
}

}  // namespace
}  // namespace retint
