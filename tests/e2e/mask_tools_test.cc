// SPDX-License-Identifier: BSD-3-Clause
// retint mask, suggest and score on the sample workspace.
#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "base/files.h"
#include "colmap_io/image_io.h"
#include "tests/e2e/command.h"
#include "tests/support/data.h"

namespace retint {
namespace {

using nlohmann::json;
using testing::HasSubstr;

std::vector<std::string> With(const std::string& verb, const std::vector<std::string>& more) {
  std::vector<std::string> arguments = {verb, TinyWorkspace().string(), "--splat",
                                        (TinyWorkspace() / "splat.ply").string()};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

// A pixel of the brush mask with much of it on all sides.
std::pair<int, int> Middle(const Mask& mask) {
  double sum_x = 0, sum_y = 0, count = 0;
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      if (mask(x, y) < 128) continue;
      sum_x += x, sum_y += y, ++count;
    }
  }
  return {static_cast<int>(sum_x / count), static_cast<int>(sum_y / count)};
}

TEST(MaskVerb, KeepsStrokesAndGrowsFromThem) {
  TempFolder temp;
  const auto [x, y] = Middle(ReadMask(TinyMask()));
  const std::string at = std::to_string(x) + ".5," + std::to_string(y) + ".5";
  const std::string out = (temp / "mask.png").string();
  const CommandResult result =
      RunRetint(With("mask", {"--view", TinyView(), "--scribble", at, "--scribble-outside",
                              "2,2,157,2", "--brush", "3", "--output", out}));
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("wrote a mask of"));
  const Mask mask = ReadMask(out);
  ASSERT_EQ(mask.width, 160);
  EXPECT_EQ(mask(x, y), 255);
  EXPECT_EQ(mask(80, 1), 0);
  const CommandResult alone =
      RunRetint(With("mask", {"--view", TinyView(), "--scribble", at, "--scribble-outside",
                              "2,2,157,2", "--brush", "3", "--this-view-alone", "--output", out}));
  ASSERT_EQ(alone.code, 0) << alone.err;
  EXPECT_EQ(ReadMask(out)(x, y), 255);
}

TEST(MaskVerb, HasAWandAndLimits) {
  TempFolder temp;
  const auto [x, y] = Middle(ReadMask(TinyMask()));
  const std::string at = std::to_string(x) + "," + std::to_string(y);
  const auto mask = [&](std::vector<std::string> more) {
    const std::string out = (temp / "mask.png").string();
    more.insert(more.end(), {"--view", TinyView(), "--output", out});
    const CommandResult result = RunRetint(With("mask", more));
    EXPECT_EQ(result.code, 0) << result.err;
    return result.code == 0 ? ReadMask(out) : Mask(160, 120);
  };
  const auto area = [](const Mask& of) {
    return std::count_if(of.data.begin(), of.data.end(), [](uint8_t v) { return v >= 128; });
  };
  const Mask narrow = mask({"--wand", at + ",0.02"}), wide = mask({"--wand", at + ",0.1"});
  EXPECT_EQ(narrow(x, y), 255);
  EXPECT_LE(area(narrow), area(wide));
  const CommandResult few = RunRetint(With("mask", {"--wand", at + ",0", "--view", TinyView(),
                                                    "--output", (temp / "few.png").string()}));
  EXPECT_EQ(few.code, 0);
  EXPECT_THAT(few.err, HasSubstr("larger tolerances take more"));
  const Mask limited = mask({"--mask", TinyMask().string(), "--like", at + ",0.05"});
  EXPECT_EQ(limited(x, y), 255);
  EXPECT_LT(area(limited), area(mask({"--like", at + ",0.5"})));
  EXPECT_GT(area(mask({"--mask", TinyMask().string(), "--snap-edge", "2"})), 0);
}

TEST(MaskVerb, RefusesWhatItCannotDo) {
  TempFolder temp;
  const std::string out = (temp / "mask.png").string();
  // A black stroke on white, and one of color: nothing but strokes.
  Image8 white(160, 120);
  std::fill(white.data.begin(), white.data.end(), uint8_t{255});
  for (int x = 60; x < 90; ++x) white(x, 60, 0) = 0, white(x, 60, 1) = 0, white(x, 60, 2) = 0;
  const std::string on_white = (temp / "white.png").string(), red = (temp / "red.png").string();
  WritePng(on_white, white);
  for (int x = 60; x < 90; ++x) white(x, 60, 0) = 255;
  WritePng(red, white);
  Image8 photo = ReadImage8(TinyWorkspace() / "images" / TinyView());
  for (int x = 60; x < 90; ++x) photo(x, 60, 0) = 255, photo(x, 60, 1) = 0, photo(x, 60, 2) = 0;
  const std::string painted_over = (temp / "photo.png").string();
  WritePng(painted_over, photo);
  const struct {
    std::vector<std::string> more;
    int code;
    const char* says;
  } rows[] = {
      {{"--scribble", on_white}, 3, "white.png: most of the picture counts as a stroke"},
      {{"--scribble", red}, 3, "red.png: most of the picture counts as a stroke"},
      {{"--scribble", painted_over}, 3, "photo.png: this shows the view"},
      {{"--scribble", "5,5", "--scribble-outside", red}, 3, "red.png: most of the picture"},
      {{"--scribble", "5,5", "--scribble-outside", on_white},
       2,
       "most of the picture has a stroke"},
      {{}, 2, "nothing to select by"},
      {{"--wand", "1,1", "--scribble", "3,3"}, 2, "give one of"},
      {{"--wand", "1"}, 2, "X,Y"},
      {{"--wand", "1,one"}, 2, "X,Y"},
      {{"--wand", "500,1"}, 2, "outside the view"},
      {{"--scribble", "1,2,3"}, 2, "X,Y,X,Y"},
      {{"--scribble", "no-such-file.png"}, 3, "no-such-file.png"},
      {{"--scribble", "5,5", "--scribble-outside", "5,5"}, 2, "cross at pixel"},
      {{"--scribble-outside", "5,5", "--like", "1,1"}, 2, "needs --scribble"},
      {{"--scissors", "1,1,2,2"}, 2, "X,Y,X,Y,X,Y"},
      {{"--sphere", "0,0,0,0"}, 2, "radius"},
      {{"--sphere", "1e6,0,0,1e-3"}, 3, "no pixel"},
      {{"--box", "1,1,1,0,0,0"}, 2, "lower corner"},
  };
  for (const auto& row : rows) {
    auto more = row.more;
    more.insert(more.end(), {"--view", TinyView(), "--output", out, "--progress", "none"});
    const CommandResult result = RunRetint(With("mask", more));
    EXPECT_EQ(result.code, row.code) << result.err;
    EXPECT_THAT(result.err, HasSubstr(row.says));
    EXPECT_EQ(CountLines(result.err), 1) << result.err;
    EXPECT_FALSE(std::filesystem::exists(out));
  }
}

TEST(SuggestVerb, RanksTheViewsThatAreNotPainted) {
  TempFolder temp;
  const std::string report = (temp / "suggest.json").string();
  const CommandResult result = RunRetint(
      With("suggest", {"--view", TinyView(), "--mask", TinyMask().string(), "--depth-method",
                       "gaussian", "--count", "3", "--report", report}));
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(CountLines(result.out), 3) << result.out;
  const json views = json::parse(ReadFile(report))["views"];
  ASSERT_EQ(views.size(), 7u);
  for (size_t i = 0; i < views.size(); ++i) {
    EXPECT_NE(views[i]["view"], TinyView());
    EXPECT_GE(views[i]["fraction"], 0);
    EXPECT_LE(views[i]["fraction"], 1);
    // The part left to settle only shrinks, and the rest is in order.
    if (i != 0 && i != 3) {
      EXPECT_LE(views[i]["settles"], views[i - 1]["settles"]);
    }
  }
  const CommandResult off = RunRetint(With(
      "suggest", {"--view", TinyView(), "--mask", TinyMask().string(), "--completion", "off"}));
  EXPECT_EQ(off.code, 2);
  EXPECT_THAT(off.err, HasSubstr("--completion near or all"));
}

TEST(MaskVerb, SaysHowManyPixelsOfAStrokeAreCut) {
  TempFolder temp;
  const auto draw = [&](const std::string& points) {
    return RunRetint(With("mask", {"--view", TinyView(), "--scribble", points, "--brush", "1",
                                   "--output", (temp / "m.png").string()}));
  };
  const CommandResult cut = draw("-20,60,40,60");
  ASSERT_EQ(cut.code, 0) << cut.err;
  EXPECT_THAT(cut.err, HasSubstr(" pixels of --scribble lie outside view " + TinyView() +
                                 ", which is 160x120 pixels, and are left out"));
  const CommandResult whole = draw("20,60,40,60");
  ASSERT_EQ(whole.code, 0) << whole.err;
  EXPECT_THAT(whole.err, testing::Not(HasSubstr("left out")));
}

TEST(ScoreVerb, GivesTheTruthFullMarks) {
  TempFolder temp;
  std::filesystem::path truth;
  for (const auto& entry : std::filesystem::directory_iterator(TinyWorkspace() / "truth/masks")) {
    if (entry.is_directory()) truth = std::max(truth, entry.path());
  }
  ASSERT_FALSE(truth.empty());
  const std::string report = (temp / "score.json").string();
  const CommandResult result =
      RunRetint({"score", "--truth", truth.string(), "--masks", truth.string(), "--cameras",
                 TinyWorkspace().string(), "--painted", TinyView(), "--report", report});
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("boundary_iou"));
  EXPECT_THAT(result.out, HasSubstr("within 50 degrees"));
  const json groups = json::parse(ReadFile(report))["groups"];
  EXPECT_EQ(groups[0]["name"], "all");
  EXPECT_DOUBLE_EQ(groups[0]["iou"]["mean"], 1);
  const CommandResult nothing = RunRetint({"score", "--truth", truth.string()});
  EXPECT_EQ(nothing.code, 2);
  EXPECT_THAT(nothing.err, HasSubstr("nothing to score"));
}

}  // namespace
}  // namespace retint
