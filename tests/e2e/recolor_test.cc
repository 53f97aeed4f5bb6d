// SPDX-License-Identifier: BSD-3-Clause
// The main job, whole: painted view to recolored splat, and the same in steps through files.
#include <cstring>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "base/files.h"
#include "colmap_io/image_io.h"
#include "splat_io/splat_io.h"
#include "tests/e2e/command.h"
#include "tests/support/data.h"

namespace retint {
namespace {

using nlohmann::json;

const std::string kTint = "0.2,0.4,1.0";

std::vector<std::string> Scene() {
  return {"--workspace", TinyWorkspace().string(), "--splat",
          (TinyWorkspace() / "splat.ply").string()};
}

std::vector<std::string> Join(std::vector<std::string> a, const std::vector<std::string>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

std::vector<std::string> RecolorArguments(const TempFolder& temp) {
  return Join(Join({"recolor"}, Scene()),
              {"--view", TinyView(), "--mask", TinyMask().string(), "--tint", kTint, "--output",
               (temp / "out.ply").string()});
}

// Share of the pixels of both in either.
double Iou(const Mask& a, const Mask& b) {
  int both = 0, either = 0;
  for (size_t i = 0; i < a.data.size(); ++i) {
    const bool in_a = a.data[i] >= 128, in_b = b.data[i] >= 128;
    both += in_a && in_b;
    either += in_a || in_b;
  }
  return either == 0 ? 1 : static_cast<double>(both) / either;
}

TEST(Recolor, WritesSplatReportStagesAndPictures) {
  TempFolder temp;
  const CommandResult result = RunRetint(
      Join(RecolorArguments(temp),
           {"--report", (temp / "r.json").string(), "--save-stages", (temp / "stages").string(),
            "--comparison", (temp / "c.png").string(), "--holdout", "4"}));
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(result.out, testing::HasSubstr("out.ply"));

  const json report = json::parse(ReadFile(temp / "r.json"));
  EXPECT_EQ(report["backend"], "cpu");
  EXPECT_EQ(report["views"], 8);
  for (const char* stage :
       {"load", "depth", "cloud", "registration", "projection", "refit", "save", "total"}) {
    EXPECT_TRUE(report["stages_ms"][stage].is_number()) << stage;
  }
  EXPECT_GT(report["stages_ms"]["refit"], 0);
  EXPECT_GE(report["stages_ms"]["total"], report["stages_ms"]["refit"]);
  EXPECT_GT(report["peak_rss_mb"], 10);
  EXPECT_EQ(report["depth"]["method"], "stereo-hv");
  EXPECT_GT(report["depth"]["valid_fraction"], 0.5);
  EXPECT_GT(report["cloud"]["mask_pixels"], report["cloud"]["sampled"]);
  EXPECT_GT(report["cloud"]["sampled"], report["cloud"]["kept"]);
  EXPECT_TRUE(report["registration"]["accepted"].is_boolean());
  EXPECT_FALSE(report["registration"]["reason"].get<std::string>().empty());
  EXPECT_EQ(report["masks"]["views"], 8);
  EXPECT_EQ(report["refit"]["solver"], "mm");
  EXPECT_GE(report["refit"]["active_gaussians"], report["refit"]["changed_gaussians"]);
  const json& train = report["quality"]["train"];
  EXPECT_EQ(train["views"], 6);
  EXPECT_EQ(report["quality"]["heldout"]["views"], 2);
  EXPECT_GT(train["psnr_inside_after"].get<double>(),
            train["psnr_inside_before"].get<double>() + 10);
  EXPECT_GT(train["psnr_outside"], 35);
  EXPECT_LT(train["bleed"], 0.01);

  // Untouched Gaussians and everything but the colours come out bit for bit.
  const GaussianModel before = ReadSplat(TinyWorkspace() / "splat.ply");
  const GaussianModel after = ReadSplat(temp / "out.ply");
  EXPECT_EQ(before.means, after.means);
  EXPECT_EQ(before.quats_wxyz, after.quats_wxyz);
  EXPECT_EQ(before.log_scales, after.log_scales);
  EXPECT_EQ(before.opacity_logits, after.opacity_logits);
  ASSERT_EQ(before.sh.size(), after.sh.size());
  const size_t block = static_cast<size_t>(before.NumShCoeffs()) * 3;
  int64_t changed = 0;
  for (size_t g = 0; g < before.NumGaussians(); ++g) {
    changed += std::memcmp(&before.sh[g * block], &after.sh[g * block], block * 4) != 0;
  }
  EXPECT_EQ(report["refit"]["changed_gaussians"], changed);
  EXPECT_GT(changed, 0);
  EXPECT_LT(changed, static_cast<int64_t>(before.NumGaussians()) / 2);

  const auto files = FilesBelow(temp.path());
  for (const std::string& name :
       {"c.png", "stages/depth.bin", "stages/depth.png", "stages/cloud_raw.ply", "stages/cloud.ply",
        "stages/registration.json"}) {
    EXPECT_THAT(files, testing::Contains(name));
  }
  for (const char* folder : {"masks", "targets", "result"}) {
    EXPECT_THAT(files, testing::Contains("stages/" + std::string(folder) + "/000.png.png"));
    EXPECT_EQ(FilesBelow(temp / "stages" / folder).size(), 8u);
  }
  for (const std::string& name : files) EXPECT_EQ(name.find(".tmp"), std::string::npos) << name;
}

TEST(Recolor, ItsMasksAreTheObject) {
  TempFolder temp;
  const CommandResult result = RunRetint(
      Join(RecolorArguments(temp), {"--save-stages", (temp / "stages").string(), "--quiet"}));
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(result.out + result.err, "");
  // The painted object's own truth folder: the one whose mask of the painted view is the paint.
  const Mask paint = ReadMask(TinyMask());
  double mean = 0;
  int views = 0;
  for (const auto& object :
       std::filesystem::directory_iterator(TinyWorkspace() / "truth" / "masks")) {
    if (ReadMask(ViewFile(object.path(), TinyView())).data != paint.data) continue;
    for (const auto& file : std::filesystem::directory_iterator(object.path())) {
      const Mask truth = ReadMask(file.path());
      mean += Iou(truth, ReadMask(temp / "stages" / "masks" / file.path().filename().string()));
      ++views;
    }
  }
  ASSERT_EQ(views, 8);
  // Objects are some 20 pixels across here, so their borders are a large part of them; the figure
  // for pictures of a usual size is measured in the selection's tests.
  EXPECT_GT(mean / views, 0.6);
}

TEST(Recolor, IsTheSameOnOneThreadAndOnTwo) {
  TempFolder temp;
  for (const char* threads : {"1", "2"}) {
    auto arguments = RecolorArguments(temp);
    arguments.back() = (temp / (std::string(threads) + ".ply")).string();
    ASSERT_EQ(RunRetint(Join(arguments, {"--threads", threads, "--quiet"})).code, 0);
  }
  EXPECT_TRUE(ReadFile(temp / "1.ply") == ReadFile(temp / "2.ply"));
}

TEST(Recolor, InStepsThroughFilesGivesTheSameKindOfResult) {
  TempFolder temp;
  const std::string cloud = (temp / "cloud.ply").string(), masks = (temp / "masks").string(),
                    out = (temp / "out.ply").string(), report = (temp / "r.json").string();
  CommandResult result =
      RunRetint(Join(Join({"select"}, Scene()),
                     {"--view", TinyView(), "--mask", TinyMask().string(), "--output", cloud}));
  ASSERT_EQ(result.code, 0) << result.err;
  result = RunRetint(Join(Join({"project"}, Scene()),
                          {"--cloud", cloud, "--output", masks, "--projector", "surfels"}));
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(FilesBelow(masks).size(), 8u);
  result = RunRetint(
      Join(Join({"refit"}, Scene()), {"--masks", masks, "--tint", kTint, "--output", out}));
  ASSERT_EQ(result.code, 0) << result.err;
  result = RunRetint({"evaluate", "--workspace", TinyWorkspace().string(), "--before",
                      (TinyWorkspace() / "splat.ply").string(), "--after", out, "--masks", masks,
                      "--tint", kTint, "--report", report});
  ASSERT_EQ(result.code, 0) << result.err;
  const json parsed = json::parse(ReadFile(report));
  EXPECT_GT(parsed["quality"]["train"]["psnr_inside_after"].get<double>(),
            parsed["quality"]["train"]["psnr_inside_before"].get<double>() + 8);
  EXPECT_GT(parsed["refit"]["changed_gaussians"], 0);
}

TEST(Recolor, TakesSeveralPaintedViewsAndTheOtherSolvers) {
  TempFolder temp;
  // The object that was painted, in a second view.
  const Mask paint = ReadMask(TinyMask());
  std::string second;
  for (const auto& object :
       std::filesystem::directory_iterator(TinyWorkspace() / "truth" / "masks")) {
    if (ReadMask(ViewFile(object.path(), TinyView())).data == paint.data) {
      second = ViewFile(object.path(), "003.png").string();
    }
  }
  ASSERT_FALSE(second.empty());
  const CommandResult result =
      RunRetint(Join(RecolorArguments(temp),
                     {"--view", "003.png", "--mask", second, "--solver", "adam", "--iterations",
                      "20", "--target", "photo", "--depth", "gaussian", "--projector", "quads",
                      "--no-registration", "--report", (temp / "r.json").string()}));
  ASSERT_EQ(result.code, 0) << result.err;
  const json report = json::parse(ReadFile(temp / "r.json"));
  EXPECT_EQ(report["painted"].size(), 2u);
  EXPECT_EQ(report["refit"]["solver"], "adam");
  EXPECT_EQ(report["refit"]["iterations"], 20);
  EXPECT_EQ(report["depth"]["method"], "gaussian");
  EXPECT_EQ(report["registration"]["accepted"], false);
}

TEST(Recolor, ReplacesAnEarlierResult) {
  TempFolder temp;
  WriteFile(temp / "out.ply", "an earlier result");
  ASSERT_EQ(RunRetint(Join(RecolorArguments(temp), {"--quiet"})).code, 0);
  EXPECT_NO_THROW(ReadSplat(temp / "out.ply"));
  EXPECT_THAT(FilesBelow(temp.path()), testing::ElementsAre("out.ply"));
}

}  // namespace
}  // namespace retint
