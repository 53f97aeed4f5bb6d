// SPDX-License-Identifier: BSD-3-Clause
#include "base/input_guard.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "base/files.h"
#include "tests/support/data.h"

namespace retint {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr auto kReads = InputGuard::Guards::kReads;

class InputGuardTest : public testing::Test {
 protected:
  InputGuardTest() {
    WriteFile(In("cameras.bin"), "old");
    WriteFile(In("other.bin"), "old");
  }
  fs::path In(const std::string& name) const { return temp_ / name; }
  TempFolder temp_;
};

TEST_F(InputGuardTest, WhatWasReadIsNotReplaced) {
  {
    InputGuard guard(kReads);
    ReadFile(In("cameras.bin"));
    EXPECT_THAT([&] { WriteFile(In("cameras.bin"), "new"); },
                ThrowsMessage<OptionError>(HasSubstr("cameras.bin: is an input and would be")));
    WriteFile(In("other.bin"), "new");
  }
  EXPECT_EQ(ReadFile(In("cameras.bin")), "old");
  EXPECT_EQ(ReadFile(In("other.bin")), "new");
  WriteFile(In("cameras.bin"), "new");
}

TEST_F(InputGuardTest, NorByWhateverPath) {
  fs::create_symlink(In("cameras.bin"), In("link.bin"));
  fs::create_directory_symlink(temp_.path(), In("again"));
  InputGuard guard(kReads);
  ReadFile(In("link.bin"));
  for (const char* path : {"cameras.bin", "link.bin", "again/cameras.bin", "again/./cameras.bin"}) {
    EXPECT_THROW(InputGuard::Check(In(path)), OptionError) << path;
  }
}

TEST_F(InputGuardTest, WhatIsReadWhileItIsWrittenIsNotReplaced) {
  InputGuard guard(kReads);
  AtomicFile file(In("cameras.bin"));
  file.Write("new");
  ReadFile(In("cameras.bin"));
  EXPECT_THROW(file.Commit(), OptionError);
  EXPECT_EQ(ReadFile(In("cameras.bin")), "old");
}

TEST_F(InputGuardTest, APlannedOutputIsNotRead) {
  InputGuard guard(kReads);
  guard.Plan("--report", In("cameras.bin"));
  guard.Plan("--output", In("new.ply"));
  ReadFile(In("other.bin"));
  EXPECT_THAT([&] { ReadFile(In("cameras.bin")); },
              ThrowsMessage<OptionError>(
                  HasSubstr("--report would replace " + In("cameras.bin").string())));
  EXPECT_THROW(guard.Plan("--report", In("other.bin")), OptionError);
}

TEST_F(InputGuardTest, WithoutRecordingOnlyGivenFilesAreInputs) {
  InputGuard guard;
  ReadFile(In("cameras.bin"));
  WriteFile(In("cameras.bin"), "new");
  guard.Add(In("cameras.bin"));
  guard.Add(In("missing"));
  EXPECT_THROW(WriteFile(In("cameras.bin"), "newer"), OptionError);
  WriteFile(In("missing"), "new");
}

TEST_F(InputGuardTest, AnOutputMayBeAllowed) {
  InputGuard scene, verb;
  scene.AddSplat(In("cameras.bin"), {In("cameras.bin"), In("other.bin")});
  EXPECT_THROW(WriteFile(In("other.bin"), "new"), OptionError);
  {
    InputGuard save;
    save.AllowSplat(In("other.bin"));  // not the splat, but a part of it
    EXPECT_THROW(WriteFile(In("other.bin"), "new"), OptionError);
    save.AllowSplat(In("cameras.bin"));
    WriteFile(In("cameras.bin"), "new");
    WriteFile(In("other.bin"), "new");
  }
  EXPECT_THROW(WriteFile(In("cameras.bin"), "newer"), OptionError);
  verb.Allow(In("cameras.bin"));
  WriteFile(In("cameras.bin"), "newer");
}

}  // namespace
}  // namespace retint
