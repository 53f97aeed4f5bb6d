// SPDX-License-Identifier: BSD-3-Clause
#include "base/files.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>
#include <csignal>

#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/data.h"
#include "tests/support/file_size_limit.h"
#include "tests/support/privileges.h"

namespace retint {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Throws;
using ::testing::ThrowsMessage;
using ::testing::UnorderedElementsAre;

std::vector<std::string> Entries(const fs::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    names.push_back(entry.path().lexically_relative(folder).string());
  }
  return names;
}

TEST(ReadFileTest, ReadsEveryByte) {
  const TempFolder folder;
  std::string bytes(3'000'001, '\0');
  for (size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<char>(i * 31 + i / 256);
  std::ofstream(folder / "a", std::ios::binary) << bytes;
  EXPECT_EQ(ReadFile(folder / "a"), bytes);
  std::ofstream(folder / "empty", std::ios::binary).flush();
  EXPECT_EQ(ReadFile(folder / "empty"), "");
}

TEST(ReadFileTest, RefusesWhatIsNoFile) {
  const TempFolder folder;
  EXPECT_THAT([&] { ReadFile(folder / "none"); },
              ThrowsMessage<InputError>(AllOf(HasSubstr((folder / "none").string()),
                                              HasSubstr("No such file or directory"))));
  EXPECT_THAT([&] { ReadFile(folder.path()); }, ThrowsMessage<InputError>(HasSubstr("not a file")));
  ASSERT_EQ(mkfifo((folder / "pipe").c_str(), 0600), 0);
  // Must answer at once: nothing will ever write to this pipe.
  EXPECT_THAT([&] { ReadFile(folder / "pipe"); },
              ThrowsMessage<InputError>(HasSubstr("not a file")));
}

TEST(ReadFileTest, TellsFilesFromFolders) {
  const TempFolder folder;
  WriteFile(folder / "a", "1");
  EXPECT_TRUE(IsFile(folder / "a"));
  EXPECT_FALSE(IsFile(folder.path()));
  EXPECT_TRUE(IsFolder(folder.path()));
  EXPECT_FALSE(IsFolder(folder / "a"));
  EXPECT_FALSE(IsFile(folder / std::string(5000, 'x'))) << "a name no file can have";
}

TEST(ListTest, FoldersAreListedWithAndWithoutWhatIsBelow) {
  const TempFolder folder;
  WriteFile(folder / "a", "");
  WriteFile(folder / "b/c", "");
  EXPECT_THAT(ListFolder(folder.path()), UnorderedElementsAre(folder / "a", folder / "b"));
  EXPECT_THAT(ListBelow(folder.path()),
              UnorderedElementsAre(folder / "a", folder / "b", folder / "b/c"));
  std::error_code code;
  EXPECT_THAT(ListFolder(folder / "none", &code), ::testing::IsEmpty());
  EXPECT_EQ(code, std::errc::no_such_file_or_directory);
}

TEST(ListTest, WhatCannotBeReadOnTheWayIsTold) {
  const ChildOutcome outcome = RunAsOrdinaryUser([] {
    const TempFolder folder;
    fs::create_directory(folder / "locked");
    fs::permissions(folder / "locked", fs::perms::none);
    std::error_code code;
    EXPECT_THAT(ListBelow(folder.path(), &code), UnorderedElementsAre(folder / "locked"));
    EXPECT_EQ(code, std::errc::permission_denied);
    fs::permissions(folder / "locked", fs::perms::owner_all);
  });
  EXPECT_EQ(outcome, ChildOutcome::kPassed);
}

TEST(AtomicFileTest, WritesWholeAndInOrder) {
  const TempFolder folder;
  const std::string large(2'500'000, 'x');  // more than two buffers
  {
    AtomicFile file(folder / "sub/deeper/a.bin");
    file.Write("head");
    file.Write(large);
    file.WriteValue(uint32_t{0x64636261});
    EXPECT_FALSE(fs::exists(folder / "sub/deeper/a.bin")) << "nothing in place before Commit";
    file.Commit();
  }
  EXPECT_EQ(ReadFile(folder / "sub/deeper/a.bin"), "head" + large + "abcd");
  EXPECT_EQ(Entries(folder / "sub/deeper"), std::vector<std::string>{"a.bin"});
}

TEST(AtomicFileTest, WithoutCommitTheOldFileStaysAndNothingElse) {
  const TempFolder folder;
  WriteFile(folder / "a", "old");
  {
    AtomicFile file(folder / "a");
    file.Write(std::string(2'000'000, 'n'));
  }
  EXPECT_EQ(ReadFile(folder / "a"), "old");
  EXPECT_EQ(Entries(folder.path()), std::vector<std::string>{"a"});
}

TEST(AtomicFileTest, WithoutCommitNewFoldersGo) {
  const TempFolder folder;
  { AtomicFile file(folder / "x/y/a"); }
  EXPECT_THAT(Entries(folder.path()), ::testing::IsEmpty());
  {
    AtomicFile file(folder / "x/y/a");
    WriteFile(folder / "x/other", "kept");
  }
  EXPECT_THAT(Entries(folder.path()), UnorderedElementsAre("x", "x/other"));
}

TEST(AtomicFileTest, CommitReplacesTheOldFile) {
  const TempFolder folder;
  WriteFile(folder / "a", "a longer old text");
  WriteFile(folder / "a", "new");
  EXPECT_EQ(ReadFile(folder / "a"), "new");
}

TEST(AtomicFileTest, FileAsParentIsARunErrorNamingTheTarget) {
  // Works for root too, whom no folder's permissions stop.
  const TempFolder folder;
  WriteFile(folder / "file", "kept");
  EXPECT_THAT([&] { WriteFile(folder / "file/a", "x"); },
              ThrowsMessage<RunError>(HasSubstr((folder / "file/a").string())));
  EXPECT_EQ(ReadFile(folder / "file"), "kept");
}

TEST(AtomicFileTest, WhatAKilledProgramLeftIsPassedOver) {
  const TempFolder folder;
  std::string name;  // .retint-<process>-<number>.tmp
  {
    const AtomicFile file(folder / "a");
    name = Entries(folder.path()).at(0);
  }
  const size_t at = name.rfind('-') + 1;
  for (int next = 1; next <= 3; ++next) {
    const int number = std::stoi(name.substr(at)) + next;
    std::ofstream(folder / (name.substr(0, at) + std::to_string(number) + ".tmp")) << "left";
  }
  WriteFile(folder / "a", "new");
  EXPECT_EQ(ReadFile(folder / "a"), "new");
  EXPECT_EQ(Entries(folder.path()).size(), 4u) << "it may be another program's";
}

TEST(AtomicFileTest, UnwritableFolderIsARunError) {
  const ChildOutcome outcome = RunAsOrdinaryUser([] {
    const TempFolder folder;
    fs::create_directory(folder / "locked");
    fs::permissions(folder / "locked", fs::perms::owner_read | fs::perms::owner_exec);
    EXPECT_THAT([&] { WriteFile(folder / "locked/a", "x"); },
                ThrowsMessage<RunError>(HasSubstr("Permission denied")));
    fs::permissions(folder / "locked", fs::perms::owner_all);
    EXPECT_NO_THROW(WriteFile(folder / "locked/a", "x"));
  });
  EXPECT_EQ(outcome, ChildOutcome::kPassed);
}

TEST(AtomicFileTest, FolderAsTargetIsARunError) {
  const TempFolder folder;
  EXPECT_THAT([&] { WriteFile(folder.path(), "x"); },
              ThrowsMessage<RunError>(HasSubstr("is a folder")));
}

TEST(AtomicFileTest, PipeOrDeviceIsNotReplaced) {
  const TempFolder folder;
  ASSERT_EQ(mkfifo((folder / "pipe").c_str(), 0600), 0);
  EXPECT_THAT([&] { WriteFile(folder / "pipe", "x"); },
              ThrowsMessage<RunError>(HasSubstr("is not a regular file")));
  EXPECT_TRUE(fs::is_fifo(folder / "pipe"));
  EXPECT_THAT([] { WriteFile("/dev/full", "x"); }, Throws<RunError>());
  EXPECT_TRUE(fs::is_character_file("/dev/full"));
}

TEST(AtomicFileTest, ALinkMakesItsTarget) {
  TempFolder folder;
  fs::create_directory(folder / "store");
  fs::create_symlink("store/real", folder / "relative");
  fs::create_symlink(folder / "relative", folder / "link");
  WriteFile(folder / "link", "new");
  EXPECT_TRUE(fs::is_symlink(folder / "link"));
  EXPECT_TRUE(fs::is_symlink(folder / "relative"));
  EXPECT_EQ(ReadFile(folder / "store/real"), "new");
  fs::create_symlink("b", folder / "a");
  fs::create_symlink("a", folder / "b");
  EXPECT_THROW(WriteFile(folder / "a", "new"), RunError);
}

TEST(AtomicFileTest, LinkStaysALink) {
  const TempFolder folder;
  WriteFile(folder / "store/real", "old");
  fs::create_symlink(folder / "store/real", folder / "link");
  WriteFile(folder / "link", "new");
  EXPECT_TRUE(fs::is_symlink(folder / "link"));
  EXPECT_EQ(ReadFile(folder / "store/real"), "new");
}

TEST(AtomicFileTest, LongestNameFits) {
  const TempFolder folder;
  const std::string name(255, 'n');
  WriteFile(folder / name, "x");
  EXPECT_EQ(ReadFile(folder / name), "x");
  EXPECT_THAT([&] { WriteFile(folder / (name + "n"), "x"); }, Throws<RunError>());
  EXPECT_EQ(Entries(folder.path()), std::vector<std::string>{name});
}

TEST(AtomicFileTest, FullDiskKeepsTheOldFile) {
  const TempFolder folder;
  WriteFile(folder / "a", "old");
  const std::string large(3'000'000, 'x');
  const std::string small(200'000, 'x');  // stays in the buffer until Commit
  {
    const FileSizeLimit limit(100'000);
    for (const std::string& bytes : {large, small}) {
      EXPECT_THAT([&] { WriteFile(folder / "a", bytes); },
                  ThrowsMessage<RunError>(HasSubstr((folder / "a").string())));
      EXPECT_THAT([&] { WriteFile(folder / "new/b", bytes); }, Throws<RunError>());
    }
  }
  EXPECT_EQ(ReadFile(folder / "a"), "old");
  EXPECT_EQ(Entries(folder.path()), std::vector<std::string>{"a"});
}

TEST(AtomicFileTest, SyncedFilesAreInPlaceOnlyAfterCommit) {
  const TempFolder folder;
  WriteFile(folder / "a", "old");
  AtomicFile file(folder / "a");
  file.Write("ne");
  file.Sync();
  EXPECT_EQ(ReadFile(folder / "a"), "old");
  file.Write("w");
  file.Commit();
  EXPECT_EQ(ReadFile(folder / "a"), "new");
}

TEST(ByteReaderTest, ReadsInOrder) {
  std::string bytes("\x01\x02\x03\x04name\x07", 9);
  ByteReader reader(bytes, "m.bin");
  EXPECT_EQ(reader.Read<uint32_t>("id"), 0x04030201u);
  EXPECT_EQ(reader.ReadBytes(4, "name"), "name");
  EXPECT_EQ(reader.Offset(), 8u);
  EXPECT_EQ(reader.Remaining(), 1u);
  EXPECT_EQ(reader.Read<uint8_t>("end"), 7);
  EXPECT_EQ(reader.Remaining(), 0u);
}

TEST(ByteReaderTest, OverrunsAreInputErrorsThatMoveNothing) {
  ByteReader reader("12345", "m.bin");
  EXPECT_THAT([&] { reader.Read<uint64_t>("image count"); },
              ThrowsMessage<InputError>("m.bin: truncated: image count needs 8 bytes, only 5 bytes "
                                        "follow offset 0"));
  EXPECT_THAT([&] { reader.ReadBytes(6, "name bytes"); }, Throws<InputError>());
  EXPECT_EQ(reader.Offset(), 0u);
  EXPECT_EQ(reader.Read<uint8_t>("x"), '1');
}

TEST(ByteReaderTest, CountsThatOverflowAreRefused) {
  ByteReader reader("12345678", "m.bin");
  EXPECT_NO_THROW(reader.Require(2, 4, "points"));
  EXPECT_THAT(
      [&] { reader.Require(3, 4, "points"); },
      ThrowsMessage<InputError>("m.bin: truncated: 3 points need 4 bytes each, only 8 bytes "
                                "follow offset 0"));
  // 2^62 * 8 is 0 modulo 2^64.
  EXPECT_THAT([&] { reader.Require(uint64_t{1} << 62, 8, "points"); }, Throws<InputError>());
}

TEST(AtomicFileTest, CopiesAFileAndWritesOverIt) {
  const TempFolder folder;
  std::string bytes(3'000'001, '\0');
  for (size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<char>(i * 31 + i / 256);
  WriteFile(folder / "from", bytes);
  const int from = open((folder / "from").c_str(), O_RDONLY);
  ASSERT_GE(from, 0);
  {
    AtomicFile file(folder / "to");
    uint64_t reported = 0;
    file.CopyFrom(from, bytes.size(), [&](uint64_t done) { reported = done; });
    EXPECT_LE(reported, bytes.size());
    file.Write("after it");
    file.WriteAt(1'000'000, "over it", 7);
    file.Commit();
  }
  close(from);
  EXPECT_EQ(ReadFile(folder / "to"), bytes.replace(1'000'000, 7, "over it") + "after it");
}

TEST(AtomicFileTest, ACopyOfAFileThatBecameShorterIsAnError) {
  const TempFolder folder;
  WriteFile(folder / "from", "short");
  const int from = open((folder / "from").c_str(), O_RDONLY);
  ASSERT_GE(from, 0);
  AtomicFile file(folder / "to");
  EXPECT_THAT([&] { file.CopyFrom(from, 100, [](uint64_t) {}); },
              ThrowsMessage<RunError>(HasSubstr("became shorter")));
  close(from);
  EXPECT_FALSE(fs::exists(folder / "to"));
}

}  // namespace
}  // namespace retint
