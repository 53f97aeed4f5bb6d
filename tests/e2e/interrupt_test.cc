// SPDX-License-Identifier: BSD-3-Clause
// Ctrl-C at every stage: exit code 130, one line, and the folder as it was.
#include <csignal>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "base/files.h"
#include "tests/e2e/command.h"
#include "tests/support/data.h"

namespace retint {
namespace {

// stderr's lines that are not progress.
std::string WithoutProgress(const std::string& err) {
  std::istringstream lines(err);
  std::string line, rest;
  while (std::getline(lines, line)) {
    if (line.rfind("{\"stage\"", 0) != 0) rest += line + "\n";
  }
  return rest;
}

std::vector<std::string> Recolor(const TempFolder& temp, const std::string& iterations) {
  return {"recolor",       TinyWorkspace().string(),
          "--splat",       (TinyWorkspace() / "splat.ply").string(),
          "--view",        TinyView(),
          "--mask",        TinyMask().string(),
          "--tint",        "#3060ff",
          "--output",      (temp / "out.ply").string(),
          "--report",      (temp / "new/r.json").string(),
          "--save-stages", (temp / "stages").string(),
          "--set",         "solver=adam",
          "--set",         "iterations=" + iterations,
          "--progress",    "json"};
}

class InterruptAt : public testing::TestWithParam<const char*> {};

TEST_P(InterruptAt, LeavesNothingBehind) {
  TempFolder temp;
  WriteFile(temp / "out.ply", "an earlier result");
  CommandOptions options;
  const std::string stage = "\"stage\":\"" + std::string(GetParam()) + "\"";
  options.interrupt_when = [&](const std::string& err) {
    return err.find(stage) != std::string::npos;
  };
  // So many steps that no run ends before its signal comes.
  const CommandResult result = RunRetint(Recolor(temp, "5000000"), options);
  EXPECT_EQ(result.code, 130) << result.err;
  const auto message = nlohmann::json::parse(WithoutProgress(result.err));
  EXPECT_EQ(message["code"], 130);
  EXPECT_EQ(message["message"], "interrupted; nothing was written");
  EXPECT_EQ(result.out, "");
  EXPECT_THAT(FilesBelow(temp.path()), testing::ElementsAre("out.ply"));
  EXPECT_EQ(ReadFile(temp / "out.ply"), "an earlier result");
}

INSTANTIATE_TEST_SUITE_P(Stages, InterruptAt,
                         testing::Values("load", "depth", "cloud", "registration", "projection",
                                         "refit"));

// A dropped connection; nohup's child goes on.
TEST(Interrupt, AHangupIsAnInterrupt) {
  TempFolder temp;
  CommandOptions options;
  options.signal = SIGHUP;
  options.interrupt_when = [](const std::string& err) {
    return err.find("\"stage\":\"refit\"") != std::string::npos;
  };
  const CommandResult result = RunRetint(Recolor(temp, "5000000"), options);
  EXPECT_EQ(result.code, 130) << result.err;
  EXPECT_TRUE(FilesBelow(temp.path()).empty());
  options.launcher = {"nohup"};
  const CommandResult ignored = RunRetint(Recolor(temp, "30"), options);
  EXPECT_EQ(ignored.code, 0) << ignored.err;
}

TEST(Interrupt, WhileSavingIsAllOrNothing) {
  TempFolder temp;
  CommandOptions options;
  options.interrupt_when = [](const std::string& err) {
    return err.find("\"stage\":\"save\"") != std::string::npos;
  };
  const CommandResult result = RunRetint(Recolor(temp, "3"), options);
  if (result.code == 130) {
    EXPECT_TRUE(FilesBelow(temp.path()).empty());
  } else {
    // The signal came when everything was in place.
    ASSERT_EQ(result.code, 0) << result.err;
    EXPECT_THAT(FilesBelow(temp.path()),
                testing::IsSupersetOf({"out.ply", "new/r.json", "stages/depth.bin"}));
  }
  for (const std::string& name : FilesBelow(temp.path())) {
    EXPECT_EQ(name.find(".tmp"), std::string::npos) << name;
  }
}

TEST(Interrupt, OfASynthLeavesNoWorkspace) {
  TempFolder temp;
  CommandOptions options;
  options.interrupt_when = [](const std::string& err) {
    return err.find("\"stage\":\"photos\"") != std::string::npos;
  };
  const CommandResult result =
      RunRetint({"synth", "--output", (temp / "ws").string(), "--width", "320", "--height", "240",
                 "--photos", "200", "--progress", "json"},
                options);
  EXPECT_EQ(result.code, 130);
  EXPECT_TRUE(FilesBelow(temp.path()).empty());
}

}  // namespace
}  // namespace retint
