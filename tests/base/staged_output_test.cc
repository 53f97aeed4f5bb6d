// SPDX-License-Identifier: BSD-3-Clause
#include "base/staged_output.h"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "base/files.h"
#include "base/input_guard.h"
#include "tests/support/data.h"
#include "tests/support/privileges.h"

namespace retint {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> Tree(const fs::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    names.push_back(entry.path().lexically_relative(folder).string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

auto Text(const std::string& text) {
  return [text](const fs::path& path) { WriteFile(path, text); };
}

TEST(StagedOutput, WritesNothingWithoutCommit) {
  TempFolder temp;
  WriteFile(temp / "old.txt", "old");
  {
    StagedOutput staged;
    staged.Add(temp / "old.txt", Text("new"));
    staged.Add(temp / "deep/er/file.txt", Text("new"));
    staged.AddFolder(temp / "folder", [](const fs::path& path) { WriteFile(path / "a", "a"); });
    EXPECT_EQ(ReadFile(temp / "old.txt"), "old");
    EXPECT_FALSE(fs::exists(temp / "deep"));
  }
  EXPECT_THAT(Tree(temp.path()), testing::ElementsAre("old.txt"));
}

TEST(StagedOutput, CommitPutsEverythingInPlace) {
  TempFolder temp;
  WriteFile(temp / "old.txt", "old");
  WriteFile(temp / "folder/kept", "kept");
  {
    StagedOutput staged;
    staged.Add(temp / "old.txt", Text("new"));
    staged.Add(temp / "deep/er/file.txt", Text("deep"));
    staged.AddFolder(temp / "folder", [](const fs::path& path) {
      WriteFile(path / "a", "a");
      WriteFile(path / "sub/b", "b");
    });
    staged.Commit();
  }
  EXPECT_EQ(ReadFile(temp / "old.txt"), "new");
  EXPECT_EQ(ReadFile(temp / "deep/er/file.txt"), "deep");
  EXPECT_EQ(ReadFile(temp / "folder/sub/b"), "b");
  EXPECT_THAT(Tree(temp.path()),
              testing::ElementsAre("deep", "deep/er", "deep/er/file.txt", "folder", "folder/a",
                                   "folder/kept", "folder/sub", "folder/sub/b", "old.txt"));
}

TEST(StagedOutput, ErrorsNameTheTargetAndLeaveNothing) {
  TempFolder temp;
  try {
    StagedOutput staged;
    staged.Add(temp / "fine.txt", Text("fine"));
    staged.Add(temp / "out.txt", [](const fs::path& path) {
      throw RunError(path.string() + ": cannot write: disk full");
    });
    FAIL() << "no error";
  } catch (const RunError& error) {
    EXPECT_EQ(std::string(error.what()), (temp / "out.txt").string() + ": cannot write: disk full");
  }
  EXPECT_THAT(Tree(temp.path()), testing::IsEmpty());
}

TEST(StagedOutput, ErrorsNameFilesBesideTheTarget) {
  TempFolder temp;
  StagedOutput staged;
  const auto fail = [](const fs::path& path) {
    throw RunError((path.parent_path() / "part" / "a.webp").string() + ": disk full");
  };
  EXPECT_THAT([&] { staged.Add(temp / "out.json", fail); },
              testing::ThrowsMessage<RunError>((temp / "part/a.webp").string() + ": disk full"));
  EXPECT_THAT([&] { staged.Add("out.json", fail); },
              testing::ThrowsMessage<RunError>("part/a.webp: disk full"));
}

TEST(StagedOutput, AFileInTheWayOfTheLastStopsAllBeforeTheFirst) {
  TempFolder temp;
  for (const char* name : {"a/old.txt", "b", "out.json"}) WriteFile(temp / name, "old");
  StagedOutput staged;
  staged.Add(temp / "out.json", [](const fs::path& path) {
    for (const char* name : {"a/old.txt", "b/new.txt"}) WriteFile(path.parent_path() / name, "new");
    WriteFile(path, "new");
  });
  EXPECT_THAT([&] { staged.Commit(); },
              testing::ThrowsMessage<RunError>(testing::HasSubstr("b/new.txt: cannot write")));
  for (const char* name : {"a/old.txt", "b", "out.json"}) {
    EXPECT_EQ(ReadFile(temp / name), "old") << name;
  }
}

TEST(StagedOutput, WhatAKilledProgramLeftIsPassedOver) {
  TempFolder temp;
  const std::string left = ".retint-" + std::to_string(getpid()) + "-";
  for (int i = 0; i < 3; ++i) fs::create_directory(temp / (left + std::to_string(i) + ".tmp"));
  StagedOutput staged;
  staged.Add(temp / "out.txt", Text("new"));
  staged.Commit();
  EXPECT_EQ(ReadFile(temp / "out.txt"), "new");
}

TEST(StagedOutput, LinksAreFollowed) {
  TempFolder temp;
  WriteFile(temp / "store/old.txt", "old");
  fs::create_symlink("store/old.txt", temp / "link.txt");
  fs::create_symlink(temp / "store/new.txt", temp / "dangling.txt");
  fs::create_directory(temp / "folder");
  fs::create_symlink("../store/mask.png", temp / "folder/mask.png");
  fs::create_symlink("store/folder", temp / "other");
  {
    StagedOutput staged;
    staged.Add(temp / "link.txt", Text("new"));
    staged.Add(temp / "dangling.txt", Text("made"));
    staged.AddFolder(temp / "folder",
                     [](const fs::path& path) { WriteFile(path / "mask.png", "mask"); });
    staged.AddFolder(temp / "other", [](const fs::path& path) { WriteFile(path / "a", "a"); });
    staged.Commit();
  }
  EXPECT_EQ(ReadFile(temp / "store/old.txt"), "new");
  EXPECT_EQ(ReadFile(temp / "store/new.txt"), "made");
  EXPECT_EQ(ReadFile(temp / "store/mask.png"), "mask");
  EXPECT_EQ(ReadFile(temp / "store/folder/a"), "a");
  for (const char* link : {"link.txt", "dangling.txt", "folder/mask.png", "other"}) {
    EXPECT_TRUE(fs::is_symlink(temp / link)) << link;
  }
  for (const std::string& name : Tree(temp.path())) {
    EXPECT_EQ(name.find(".tmp"), std::string::npos) << name;
  }
}

// A rename cannot leave a file system.
TEST(StagedOutput, LinksLeadToOtherFileSystems) {
  const fs::path other = "/dev/shm";
  struct stat here {
  }, there{};
  TempFolder temp;
  if (stat(other.c_str(), &there) != 0 || access(other.c_str(), W_OK) != 0 ||
      stat(temp.path().c_str(), &here) != 0 || here.st_dev == there.st_dev) {
    GTEST_SKIP() << "needs two file systems";
  }
  const fs::path target = other / temp.path().filename();
  fs::create_directory(target);
  fs::create_symlink(target / "a.txt", temp / "a.txt");
  fs::create_directory(temp / "folder");
  fs::create_symlink(target / "b.txt", temp / "folder/b.txt");
  {
    StagedOutput staged;
    staged.Add(temp / "a.txt", [](const fs::path& path) {
      WriteFile(path, "a");
      WriteFile(path.parent_path() / "part.bin", "part");
    });
    staged.AddFolder(temp / "folder", [](const fs::path& path) { WriteFile(path / "b.txt", "b"); });
    staged.Commit();
  }
  EXPECT_EQ(ReadFile(target / "a.txt"), "a");
  EXPECT_EQ(ReadFile(target / "b.txt"), "b");
  EXPECT_EQ(ReadFile(temp / "part.bin"), "part") << "where the name says";
  EXPECT_THAT(Tree(target), testing::ElementsAre("a.txt", "b.txt"));
  fs::remove_all(target);
}

TEST(StagedOutput, AnInputStopsAllBeforeTheFirst) {
  TempFolder temp;
  WriteFile(temp / "a.txt", "old");
  WriteFile(temp / "masks/b.png", "painted");
  InputGuard guard(InputGuard::Guards::kReads);
  StagedOutput staged;
  staged.Add(temp / "a.txt", Text("new"));
  staged.AddFolder(temp / "masks", [](const fs::path& path) { WriteFile(path / "b.png", "new"); });
  ReadFile(temp / "masks/b.png");
  EXPECT_THROW(staged.Commit(), OptionError);
  EXPECT_EQ(ReadFile(temp / "masks/b.png"), "painted");
  EXPECT_EQ(ReadFile(temp / "a.txt"), "old");
}

TEST(StagedOutput, WritersSeeTheNameTheyWerePromised) {
  TempFolder temp;
  StagedOutput staged;
  staged.Add(temp / "scene.ply", [](const fs::path& path) {
    EXPECT_EQ(path.filename(), "scene.ply");
    WriteFile(path, "");
  });
}

TEST(CheckOutput, RefusesWhatCannotBeWritten) {
  TempFolder temp;
  WriteFile(temp / "file", "");
  EXPECT_NO_THROW(CheckOutput(temp / "new.txt"));
  EXPECT_NO_THROW(CheckOutput(temp / "file"));
  EXPECT_NO_THROW(CheckOutput(temp / "a/b/new.txt"));
  EXPECT_NO_THROW(CheckOutput(temp / "a", true));
  EXPECT_NO_THROW(CheckOutput(temp.path(), true));
  EXPECT_THROW(CheckOutput(temp.path()), RunError) << "a folder is no file";
  EXPECT_THROW(CheckOutput(temp / "file", true), RunError) << "a file is no folder";
  EXPECT_THROW(CheckOutput(temp / "file/below.txt"), RunError);
  EXPECT_THROW(CheckOutput(temp / "file/below/deep", true), RunError);
  EXPECT_THROW(CheckOutput(""), OptionError);
  EXPECT_THROW(CheckOutput("/dev/null"), RunError) << "a rename would replace the device";
  EXPECT_THAT(Tree(temp.path()), testing::ElementsAre("file")) << "checking creates nothing";
}

TEST(CheckOutput, RefusesAFolderWithoutPermission) {
  const ChildOutcome outcome = RunAsOrdinaryUser([] {
    TempFolder temp;
    chmod(temp.path().c_str(), 0500);
    EXPECT_THROW(CheckOutput(temp / "new.txt"), RunError);
    chmod(temp.path().c_str(), 0700);
    EXPECT_NO_THROW(CheckOutput(temp / "new.txt"));
  });
  EXPECT_EQ(outcome, ChildOutcome::kPassed);
}

std::vector<double> Fractions(const std::vector<Progress>& steps) {
  std::vector<double> fractions;
  for (const Progress& step : steps) fractions.push_back(step.fraction);
  return fractions;
}

TEST(WriteOnAllCores, WritesEveryFileAndReportsInOrder) {
  TempFolder temp;
  constexpr size_t kFiles = 50;  // more than are written at a time
  std::vector<Progress> steps;
  Monitor monitor([&](const Progress& step) { steps.push_back(step); });
  std::vector<size_t> made;
  const auto make = [&](size_t i) -> std::function<void()> {
    made.push_back(i);
    return [path = temp / std::to_string(i), i] { WriteFile(path, std::to_string(i)); };
  };
  WriteOnAllCores(kFiles, make, monitor);
  ASSERT_EQ(made.size(), kFiles);
  EXPECT_TRUE(std::is_sorted(made.begin(), made.end()));
  const std::vector<double> fractions = Fractions(steps);
  EXPECT_EQ(fractions.size(), kFiles + 1);  // before each, and at the end
  EXPECT_EQ(fractions.back(), 1);
  EXPECT_TRUE(std::is_sorted(fractions.begin(), fractions.end()));
  for (size_t i = 0; i < kFiles; ++i) {
    EXPECT_EQ(ReadFile(temp / std::to_string(i)), std::to_string(i));
  }
  WriteOnAllCores(0, make, monitor);
}

TEST(WriteOnAllCores, ThrowsTheFirstErrorOfTheFilesOrder) {
  Monitor monitor;
  const auto make = [](size_t i) -> std::function<void()> {
    return [i] {
      if (i % 2 == 1) throw RunError("file " + std::to_string(i));
    };
  };
  EXPECT_THAT([&] { WriteOnAllCores(40, make, monitor); },
              testing::ThrowsMessage<RunError>("file 1"));
}

TEST(WriteOnAllCores, MakesNothingMoreOnceCancelled) {
  size_t made = 0;
  Monitor monitor;
  const auto make = [&](size_t i) -> std::function<void()> {
    ++made;
    if (i == 20) monitor.Cancel();
    return [] {};
  };
  EXPECT_THROW(WriteOnAllCores(40, make, monitor), Cancelled);
  EXPECT_EQ(made, 21u);
}

}  // namespace
}  // namespace retint
