// SPDX-License-Identifier: BSD-3-Clause
// The files that `retint recolor` keeps beside its splat: the page, and stages in --cache.
#include <chrono>
#include <filesystem>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/files.h"
#include "colmap_io/image_io.h"
#include "tests/e2e/command.h"
#include "tests/support/data.h"

namespace retint {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

class RecolorFiles : public testing::Test {
 protected:
  CommandResult Recolor(const std::string& output, const std::vector<std::string>& more,
                        bool adds_flags = true) {
    std::vector<std::string> arguments = {"recolor",      TinyWorkspace().string(),
                                          "--output",     (temp_ / output).string(),
                                          "--completion", "off",
                                          "--set",        "iterations=2"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    CommandOptions how;
    how.adds_flags = adds_flags;
    return RunRetint(arguments, how);
  }
  std::vector<std::string> Painted(const std::string& color) {
    return {"--view", TinyView(), "--mask", TinyMask().string(), "--tint", color};
  }
  // With --cache.
  std::vector<std::string> Cached(std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--cache", (temp_ / "cache").string()});
    return arguments;
  }
  int Stages(const std::string& stage) {
    int count = 0;
    for (const auto& entry : fs::directory_iterator(temp_ / "cache")) {
      count += entry.path().filename().string().starts_with(stage + "-");
    }
    return count;
  }

  TempFolder temp_;
};

TEST_F(RecolorFiles, APageOfAnotherProgramStaysAndIsNamed) {
  const std::vector<std::string> arguments = Painted("0.2,0.4,1");
  WriteFile(temp_ / "out.html", "<p>My notes</p>");
  CommandResult result = Recolor("out.ply", arguments, /*adds_flags=*/false);
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("out.html is not a page of Retint and stays"));
  EXPECT_THAT(result.out, Not(HasSubstr("out.html")));
  EXPECT_EQ(ReadFile(temp_ / "out.html"), "<p>My notes</p>");
  fs::remove(temp_ / "out.html");
  for (int run = 0; run < 2; ++run) {  // the second run replaces the page of the first
    result = Recolor("out.ply", arguments, /*adds_flags=*/false);
    ASSERT_EQ(result.code, 0) << result.err;
    EXPECT_THAT(result.out, HasSubstr("out.html"));
    EXPECT_THAT(result.err, Not(HasSubstr("stays")));
  }
  // The mark counts only in the head of a page.
  WriteFile(temp_ / "out.html", std::string(100'000, ' ') + "<p>Retint ");
  result = Recolor("out.ply", arguments, /*adds_flags=*/false);
  EXPECT_THAT(result.err, HasSubstr("stays"));
  result = Recolor("out.html", arguments, /*adds_flags=*/false);
  EXPECT_EQ(result.code, 2);
  EXPECT_THAT(result.err, Not(HasSubstr("--report-html")));
}

TEST_F(RecolorFiles, ACachedRunWithAnotherColorHasTheBytesOfOneWithout) {
  ASSERT_EQ(Recolor("first.ply", Cached(Painted("1,0.2,0.2"))).code, 0);
  EXPECT_EQ(Stages("select"), 1);
  // An entry beyond the limit that no run used for long.
  const fs::path old = temp_ / "cache" / ("select-" + std::string(32, '0'));
  fs::create_directory(old);
  WriteFile(old / "large", "");
  fs::resize_file(old / "large", uint64_t{3} << 30);  // a hole
  fs::last_write_time(old, fs::last_write_time(old) - std::chrono::hours(1));
  const CommandResult result = Recolor("cached.ply", Cached(Painted("0.2,0.4,1")));
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_FALSE(fs::exists(old));
  EXPECT_EQ(Stages("select"), 1);
  EXPECT_EQ(Stages("refit"), 2);
  ASSERT_EQ(Recolor("plain.ply", Painted("0.2,0.4,1")).code, 0);
  EXPECT_TRUE(ReadFile(temp_ / "cached.ply") == ReadFile(temp_ / "plain.ply"));
  EXPECT_FALSE(ReadFile(temp_ / "cached.ply") == ReadFile(temp_ / "first.ply"));
}

// An edited picture says where the change is: another picture is another selection.
TEST_F(RecolorFiles, AnotherEditedPictureSelectsAnew) {
  const auto edited = [&](bool lower_half) {
    Image picture = ReadImage(TinyWorkspace() / "images" / TinyView());
    const Mask mask = ReadMask(TinyMask());
    for (size_t p = lower_half ? mask.NumPixels() / 2 : 0; p < mask.NumPixels(); ++p) {
      if (mask.data[p] >= 128) std::swap(picture.data[3 * p], picture.data[3 * p + 2]);
    }
    WritePng(temp_ / "painted.png", picture);
    return std::vector<std::string>{"--edited",
                                    TinyView() + "=" + (temp_ / "painted.png").string()};
  };
  ASSERT_EQ(Recolor("first.ply", Cached(edited(false))).code, 0);
  EXPECT_EQ(Stages("select"), 1);
  const CommandResult result = Recolor("cached.ply", Cached(edited(true)));
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(Stages("select"), 2);
  ASSERT_EQ(Recolor("plain.ply", edited(true)).code, 0);
  EXPECT_TRUE(ReadFile(temp_ / "cached.ply") == ReadFile(temp_ / "plain.ply"));
}

}  // namespace
}  // namespace retint
