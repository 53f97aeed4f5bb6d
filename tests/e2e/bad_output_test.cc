// SPDX-License-Identifier: BSD-3-Clause
// Outputs that cannot be written: folders in their place, full and read-only disks.
#include <sys/mount.h>

#include "tests/e2e/bad_input.h"
#include "tests/support/privileges.h"

namespace retint {
namespace {

const Row kOutputRows[] = {
    // Outputs that cannot be written.
    {"OutputIsAFolder", 4, "dir.ply",
     [](Place& p) {
       fs::create_directories(p.in / "dir.ply");
       return Recolor(p, {"--output", p.In("dir.ply")});
     }},
    {"OutputBelowAFile", 4, "splat.ply/out.ply",
     [](Place& p) {
       return Recolor(p, {"--output", p.In("splat.ply/out.ply")});
     }},
    {"ReportBelowAFile", 4, "splat.ply/r.json",
     [](Place& p) {
       return Recolor(p, {"--report", p.In("splat.ply/r.json")});
     }},
    {"StagesInPlaceOfAFile", 4, "splat.ply",
     [](Place& p) {
       return Recolor(p, {"--save-stages", p.In("splat.ply")});
     }},
    {"WorkspaceInPlaceOfAFile", 4, "splat.ply",
     [](Place& p) {
       return Arguments{"synth", "--output", p.In("splat.ply")};
     }},
    {"OutputInProc", 4, "/proc/retint/out.ply",
     [](Place& p) {
       return Recolor(p, {"--output", "/proc/retint/out.ply"});
     }},
};

}  // namespace

INSTANTIATE_TEST_SUITE_P(Outputs, BadInput, testing::ValuesIn(kOutputRows), RowName);

// If the files are in place, the run has not failed, even if its messages cannot be written.
TEST(FullOutput, IsAFailureOnlyWithoutFiles) {
  Place place;
  CommandOptions full;
  full.launcher = {"sh", "-c", "exec \"$0\" \"$@\" >/dev/full"};
  const CommandResult written =
      RunRetint({"convert", place.In("splat.ply"), place.Out("out.ply")}, full);
  EXPECT_EQ(written.code, 0) << written.err;
  EXPECT_THAT(written.err, testing::HasSubstr("standard output: cannot write; the files are"));
  EXPECT_THAT(FilesBelow(place.out), testing::ElementsAre("out.ply"));
  for (const Arguments& arguments : {Arguments{"info", place.In("splat.ply")}, Arguments{"--help"},
                                     Arguments{"manual", "man"}}) {
    const CommandResult said = RunRetint(arguments, full);
    EXPECT_EQ(said.code, 4) << arguments[0];
    EXPECT_THAT(said.err, testing::HasSubstr("standard output: cannot write"));
  }
}

class FullDisk : public testing::TestWithParam<int> {};

// The limit is met in the splat, in a later picture, or in the report's place in the order.
TEST_P(FullDisk, LeavesWhatWasThere) {
  Place place;
  WriteFile(place.out / "out.ply", "an earlier result");
  CommandOptions options;
  options.max_file_bytes = GetParam();
  Arguments arguments = Recolor(place, {"--set", "iterations=1"});
  arguments.push_back("--quiet");
  const CommandResult result = RunRetint(arguments, options);
  EXPECT_EQ(result.code, 4) << result.err;
  EXPECT_EQ(CountLines(result.err), 1) << result.err;
  EXPECT_THAT(result.err, testing::HasSubstr(place.out.string() + "/out.ply"));
  EXPECT_THAT(result.err, testing::HasSubstr("cannot write"));
  EXPECT_THAT(FilesBelow(place.out), testing::ElementsAre("out.ply"));
  EXPECT_EQ(ReadFile(place.out / "out.ply"), "an earlier result");
}

INSTANTIATE_TEST_SUITE_P(Bytes, FullDisk, testing::Values(0, 1000, 100000, 2000000));

TEST(FullDisk, OfARealFileSystem) {
  TinyWorkspace();  // made here, without a fault
  const ChildOutcome outcome = RunWithMounts([] {
    Place place;
    ASSERT_EQ(mount("tmpfs", place.out.c_str(), "tmpfs", 0, "size=6m"), 0) << std::strerror(errno);
    // The splat fits, the stages' pictures beside it do not.
    WriteFile(place.out / "ballast", std::string(900000, 'x'));
    Arguments arguments = Recolor(place, {"--set", "iterations=1"});
    arguments.push_back("--quiet");
    const CommandResult result = RunRetint(arguments);
    const auto left = FilesBelow(place.out);
    umount(place.out.c_str());
    EXPECT_EQ(result.code, 4) << result.err;
    EXPECT_EQ(CountLines(result.err), 1) << result.err;
    EXPECT_THAT(result.err, testing::HasSubstr("No space left on device"));
    EXPECT_THAT(left, testing::ElementsAre("ballast"));
  });
  if (outcome == ChildOutcome::kNotAllowed) GTEST_SKIP() << "this machine forbids namespaces";
  EXPECT_EQ(outcome, ChildOutcome::kPassed);
}

TEST(ReadOnly, FolderIsToldBeforeTheWork) {
  TinyWorkspace();
  const ChildOutcome outcome = RunWithMounts([] {
    Place place;
    ASSERT_EQ(mount("tmpfs", place.out.c_str(), "tmpfs", MS_RDONLY, "size=1m"), 0)
        << std::strerror(errno);
    Arguments arguments = Recolor(place);
    arguments.insert(arguments.end(), {"--progress", "plain"});
    const CommandResult result = RunRetint(arguments);
    umount(place.out.c_str());
    // The only line: not even loading began.
    ExpectRefused(result, place, 4, place.out.string());
    EXPECT_THAT(result.err, testing::HasSubstr("Read-only file system"));
  });
  if (outcome == ChildOutcome::kNotAllowed) GTEST_SKIP() << "this machine forbids namespaces";
  EXPECT_EQ(outcome, ChildOutcome::kPassed);
}

}  // namespace retint
