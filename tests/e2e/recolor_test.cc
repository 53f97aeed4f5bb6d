// SPDX-License-Identifier: BSD-3-Clause
// The main job, whole: painted view to recolored splat, and the same in steps through files.
#include <cstring>
#include <filesystem>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "base/files.h"
#include "colmap_io/image_io.h"
#include "splat_io/splat_io.h"
#include "tests/e2e/command.h"
#include "tests/support/data.h"
#include "tests/support/iou.h"

namespace retint {
namespace {

using nlohmann::json;

const std::string kTint = "0.2,0.4,1.0";

std::vector<std::string> Scene() {
  return {TinyWorkspace().string(), "--splat", (TinyWorkspace() / "splat.ply").string()};
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

// A picture of a view with other colors in the pixels of the mask.
TEST(Recolor, TakesOverAPictureWithoutAMask) {
  TempFolder temp;
  Image picture = ReadImage(TinyWorkspace() / "images" / TinyView());
  const Mask mask = ReadMask(TinyMask());
  for (size_t p = 0; p < mask.NumPixels(); ++p) {
    if (mask.data[p] >= 128) std::swap(picture.data[3 * p], picture.data[3 * p + 2]);
  }
  WritePng(temp / "painted.png", picture);
  const CommandResult result =
      RunRetint(Join(Join({"recolor"}, Scene()),
                     {"--edited", TinyView() + "=" + (temp / "painted.png").string(), "--output",
                      (temp / "out.ply").string(), "--report", (temp / "r.json").string()}));
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(result.out, testing::HasSubstr("one color map explains"));
  const json operation = json::parse(ReadFile(temp / "r.json"))["edit"]["operations"][0];
  EXPECT_EQ(operation["op"], "picture");
  EXPECT_EQ(operation["pictures"][0]["view"], TinyView());
  // The object has one surface; its outline and gray pixels, which a swap leaves, are the rest.
  EXPECT_GT(operation["explained"].get<double>(), 0.8);
  EXPECT_LT(operation["residual"].get<double>(), 2);
  // Inside masks too; no main color is measured for that.
  const CommandResult masked = RunRetint(Join(
      Join({"refit"}, Scene()), {"--edited", TinyView() + "=" + (temp / "painted.png").string(),
                                 "--masks", (TinyWorkspace() / "masks").string(), "--set",
                                 "iterations=1", "--output", (temp / "masked.ply").string()}));
  ASSERT_EQ(masked.code, 0) << masked.err;
  EXPECT_THAT(masked.err, testing::Not(testing::HasSubstr("is measured inside the masks")));
}

// A report's edit, from any folder; its measured colors are not measured again.
TEST(Recolor, SplitsLargeGaussiansFirst) {
  TempFolder temp;
  const std::string report = (temp / "report.json").string();
  const auto split = Join(RecolorArguments(temp), {"--refine"});
  const CommandResult result =
      RunRetint(Join(split, {"--set", "refine.pixels=0.5", "--report", report}));
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(result.out, testing::HasSubstr("Gaussians split into"));
  const json found = json::parse(ReadFile(report)), refine = found["refine"];
  const size_t before = ReadSplat(TinyWorkspace() / "splat.ply").NumGaussians();
  const size_t after = before - refine["split"].get<size_t>() + refine["parts"].get<size_t>();
  EXPECT_GT(after, before);
  EXPECT_EQ(ReadSplat(temp / "out.ply").NumGaussians(), after);
  EXPECT_GT(refine["psnr"].get<double>(), 35);
  EXPECT_GT(found["stages_ms"]["refine"].get<double>(), 0);
  const json quality = found["quality"]["train"];
  EXPECT_GT(quality["psnr_inside_after"].get<double>(),
            quality["psnr_inside_before"].get<double>() + 5);
  const CommandResult alone =
      RunRetint(Join(RecolorArguments(temp), {"--set", "refine.pixels=0.5"}));
  EXPECT_EQ(alone.code, 2);
  EXPECT_THAT(alone.err, testing::HasSubstr("--refine"));
  const CommandResult parts =
      RunRetint(Join(split, {"--out-of-core", "on", "--index", (temp / "splat.index").string()}));
  EXPECT_EQ(parts.code, 2);
  EXPECT_THAT(parts.err, testing::HasSubstr("opened whole"));
}

TEST(Recolor, ItsReportIsAnEdit) {
  TempFolder temp;
  std::filesystem::create_directory(temp / "reports");
  WriteFile(temp / "film.cube", "LUT_1D_SIZE 2\n0.1 0 0\n1 0.9 1\n");
  const auto report = [&](const char* name) { return (temp / "reports" / name).string(); };
  const auto refit = [&](const std::vector<std::string>& edit, const char* name) {
    const CommandResult result = RunRetint(
        Join(Join(Join({"refit"}, Scene()), edit),
             {"--masks", (TinyWorkspace() / "masks").string(), "--output",
              (temp / "out.ply").string(), "--set", "iterations=1", "--report", report(name)}));
    EXPECT_EQ(result.code, 0) << result.err;
    return result.err;
  };
  const auto edit = [&](const char* name) { return json::parse(ReadFile(report(name)))["edit"]; };
  EXPECT_THAT(
      refit({"--to", "#3060ff", "--lut", (temp / "film.cube").string(), "--strength", "0.5"},
            "first.json"),
      testing::HasSubstr("is measured inside the masks"));
  EXPECT_THAT(refit({"--edit", report("first.json")}, "second.json"),
              testing::Not(testing::HasSubstr("is measured inside the masks")));
  EXPECT_EQ(edit("first.json")["strength"], 0.5);
  EXPECT_EQ(edit("second.json"), edit("first.json"));
  refit({"--edit", report("first.json"), "--strength", "1"}, "whole.json");
  EXPECT_FALSE(edit("whole.json").contains("strength"));
}

TEST(Recolor, SaysWhatItReplacesAndWhatNoScreenShows) {
  TempFolder temp;
  const auto recolor = [&](const std::vector<std::string>& edit) {
    const CommandResult result =
        RunRetint(Join(Join(Join({"recolor"}, Scene()), edit),
                       {"--view", TinyView(), "--mask", TinyMask().string(), "--output",
                        (temp / "out.ply").string(), "--most-views", "3"}));
    EXPECT_EQ(result.code, 0) << result.err;
    EXPECT_THAT(result.err, testing::HasSubstr("--most-views does nothing"));
    return result.out;
  };
  EXPECT_THAT(recolor({"--to", "#3060ff,from=#d0a020"}),
              testing::HasSubstr("color        main color #d0a020 becomes #3060ff\n"));
  EXPECT_THAT(recolor({"--exposure", "3"}), testing::HasSubstr("--soft-clip keeps"));
  EXPECT_THAT(recolor({"--exposure", "3", "--soft-clip"}),
              testing::Not(testing::HasSubstr("out of gamut")));
  EXPECT_THAT(recolor({"--to", "#ffffff,from=#303030"}),
              testing::Not(testing::HasSubstr("out of gamut")));
  EXPECT_THAT(recolor({"--exposure", "-1"}), testing::Not(testing::HasSubstr("out of gamut")));
}

TEST(Recolor, WritesSplatReportStagesAndPictures) {
  TempFolder temp;
  const CommandResult result =
      RunRetint(Join(RecolorArguments(temp),
                     {"--report", (temp / "r.json").string(), "--save-stages",
                      (temp / "stages").string(), "--comparison", (temp / "c.png").string(),
                      "--report-html", (temp / "r.html").string(), "--holdout", "4"}));
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(result.out, testing::HasSubstr("out.ply"));

  EXPECT_THAT(ReadFile(temp / "r.html"), testing::HasSubstr("retint recolor "));
  const json report = json::parse(ReadFile(temp / "r.json"));
  EXPECT_EQ(report["backend"], "cpu");
  EXPECT_EQ(report["views"], 8);
  for (const char* stage :
       {"load", "depth", "cloud", "registration", "projection", "refit", "save", "total"}) {
    EXPECT_TRUE(report["stages_ms"][stage].is_number()) << stage;
  }
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
  for (const char* name : {"c.png", "stages/depth.bin", "stages/depth.png", "stages/cloud_raw.ply",
                           "stages/cloud.ply", "stages/registration.json"}) {
    EXPECT_THAT(files, testing::Contains(name));
  }
  EXPECT_EQ(FilesBelow(temp / "stages" / "paint").size(), 1u) << "of the painted view";
  for (const char* folder : {"masks", "targets", "result"}) {
    EXPECT_THAT(files, testing::Contains("stages/" + std::string(folder) + "/000.png.png"));
    EXPECT_EQ(FilesBelow(temp / "stages" / folder).size(), 8u);
  }
  for (const std::string& name : files) EXPECT_EQ(name.find(".tmp"), std::string::npos) << name;
}

// Three lines, and a page beside the splat, which --no-report-html leaves out.
TEST(Recolor, SaysInThreeLinesWhatItDid) {
  TempFolder temp;
  CommandOptions plain;
  plain.adds_flags = false;
  CommandResult result = RunRetint(RecolorArguments(temp), plain);
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(result.out.rfind("changed      ", 0), 0u) << result.out;
  EXPECT_THAT(result.out, testing::HasSubstr("\nquality      "));
  EXPECT_THAT(result.out, testing::HasSubstr("\nlook at      " + (temp / "out.html").string() +
                                             ", " + (temp / "out.ply").string()));
  EXPECT_THAT(result.out, testing::Not(testing::HasSubstr("peak memory")));
  EXPECT_THAT(FilesBelow(temp.path()), testing::ElementsAre("out.html", "out.ply"));
  std::filesystem::remove(temp / "out.html");
  result = RunRetint(Join(RecolorArguments(temp), {"--no-report-html", "--quiet"}), plain);
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(result.out, "");
  EXPECT_THAT(FilesBelow(temp.path()), testing::ElementsAre("out.ply"));
}

// One argument for the scene: its splat is found, or it is a splat alone, a session or a job.
TEST(Recolor, OpensASceneByOneArgument) {
  TempFolder temp;
  const std::string splat = (TinyWorkspace() / "splat.ply").string();
  const std::string session = (temp / "s.retint").string();
  WriteFile(temp / "job.json",
            json{{"retint_job", 1},
                 {"scene", {{"workspace", TinyWorkspace().string()}, {"splat", splat}}},
                 {"regions",
                  {{{"name", "thing"},
                    {"masks", {{TinyView(), TinyMask().string()}}},
                    {"edit", {{"operations", {{{"op", "gray"}}}}}}}}},
                 {"outputs", {{"session", session}}}}
                .dump());
  ASSERT_EQ(RunRetint({"run", (temp / "job.json").string(), "--quiet"}).code, 0);
  for (const std::string& scene :
       {TinyWorkspace().string(), session, (temp / "job.json").string()}) {
    const CommandResult result = RunRetint({"info", scene, "--compare", "1"});
    ASSERT_EQ(result.code, 0) << result.err;
    EXPECT_THAT(result.out, testing::HasSubstr("splat        " + splat));
    EXPECT_THAT(result.out, testing::HasSubstr("workspace    " + TinyWorkspace().string()));
  }
  const CommandResult alone = RunRetint({"info", splat, "--views", "4", "--compare", "1"});
  EXPECT_THAT(alone.out, testing::HasSubstr("workspace    none"));
  std::filesystem::create_directory(temp / "two");
  for (const char* name : {"two/a.ply", "two/b.ply"}) WriteFile(temp / name, "ply");
  const CommandResult several =
      RunRetint({"render", (temp / "two").string(), "--all", "--output", (temp / "r").string()});
  EXPECT_EQ(several.code, 3);
  EXPECT_THAT(several.err,
              testing::HasSubstr("holds 2 splats (a.ply, b.ply): name one with --splat"));
  std::filesystem::copy(TinyWorkspace() / "sparse", temp / "two" / "sparse",
                        std::filesystem::copy_options::recursive);
  std::filesystem::create_directory(temp / "two" / "images");
  EXPECT_THAT(RunRetint({"info", (temp / "two").string()}).out,
              testing::HasSubstr("none opened: the workspace holds 2 splats (a.ply, b.ply)"));
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
      mean += IouOf(truth, ReadMask(temp / "stages" / "masks" / file.path().filename().string()));
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

// The steps with the paint, to `temp`; masks in `temp`/masks, the result in `temp`/steps.ply.
void RunSteps(const TempFolder& temp, const std::string& projector) {
  const std::string cloud = (temp / "cloud.ply").string(), masks = (temp / "masks").string();
  const std::vector<std::string> paint = {"--view", TinyView(), "--mask", TinyMask().string()};
  CommandResult result =
      RunRetint(Join(Join(Join({"select"}, Scene()), paint), {"--output", cloud}));
  ASSERT_EQ(result.code, 0) << result.err;
  result = RunRetint(Join(Join(Join({"project"}, Scene()), paint),
                          {"--cloud", cloud, "--output", masks, "--set", "projector=" + projector,
                           "--progress", "none"}));
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(result.err, "");
  result = RunRetint(
      Join(Join({"refit"}, Scene()), {"--masks", masks, "--tint", kTint, "--output",
                                      (temp / "steps.ply").string(), "--progress", "none"}));
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(result.err, "");
}

TEST(Recolor, InStepsThroughFilesGivesTheSameBytes) {
  for (const std::string projector : {"gaussians", "surfels"}) {
    TempFolder temp;
    ASSERT_NO_FATAL_FAILURE(RunSteps(temp, projector));
    const CommandResult whole =
        RunRetint(Join(RecolorArguments(temp), {"--set", "projector=" + projector, "--quiet"}));
    ASSERT_EQ(whole.code, 0) << whole.err;
    EXPECT_TRUE(ReadFile(temp / "steps.ply") == ReadFile(temp / "out.ply")) << projector;
    // Only the Gaussians' own projector knows shares.
    EXPECT_EQ(std::filesystem::exists(temp / "masks/shares.bin"), projector == "gaussians");
  }
}

TEST(Recolor, StepsGoOnFromMasksOfAnotherTool) {
  TempFolder temp;
  ASSERT_NO_FATAL_FAILURE(RunSteps(temp, "gaussians"));
  // A changed mask: the shares beside it are those of another selection.
  const auto path = ViewFile(temp / "masks", TinyView());
  Mask mask = ReadMask(path);
  mask(0, 0) = 255;
  WritePng(path, mask);
  const std::string out = (temp / "changed.ply").string(), report = (temp / "r.json").string();
  CommandResult result =
      RunRetint(Join(Join({"refit"}, Scene()), {"--masks", (temp / "masks").string(), "--tint",
                                                kTint, "--output", out, "--progress", "none"}));
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(result.err, testing::HasSubstr("computed anew from the masks"));
  EXPECT_EQ(CountLines(result.err), 1);
  EXPECT_FALSE(ReadFile(out) == ReadFile(temp / "steps.ply"));
  result = RunRetint({"evaluate", TinyWorkspace().string(), "--splat",
                      (TinyWorkspace() / "splat.ply").string(), "--after", out, "--masks",
                      (temp / "masks").string(), "--tint", kTint, "--report", report});
  ASSERT_EQ(result.code, 0) << result.err;
  const json parsed = json::parse(ReadFile(report));
  EXPECT_GT(parsed["quality"]["train"]["psnr_inside_after"].get<double>(),
            parsed["quality"]["train"]["psnr_inside_before"].get<double>() + 8);
  EXPECT_GT(parsed["refit"]["changed_gaussians"], 0);
  // Recolor measures on the paint; here, refit measures inside the masks and says so.
  EXPECT_THAT(result.err, testing::Not(testing::HasSubstr("measured inside the masks")));
  for (const std::string to : {"#3060ff", "#3060ff,from=#c8b478"}) {
    result = RunRetint({"evaluate", TinyWorkspace().string(), "--splat",
                        (TinyWorkspace() / "splat.ply").string(), "--after", out, "--masks",
                        (temp / "masks").string(), "--to", to, "--progress", "none"});
    ASSERT_EQ(result.code, 0) << result.err;
    const bool said = result.err.find("measured inside the masks") != std::string::npos;
    EXPECT_EQ(said, to == "#3060ff") << to;
  }
}

// The folder of true masks of the painted object: the one whose mask of the painted view is the
// paint.
std::filesystem::path TruthFolder() {
  const Mask paint = ReadMask(TinyMask());
  for (const auto& object :
       std::filesystem::directory_iterator(TinyWorkspace() / "truth" / "masks")) {
    if (ReadMask(ViewFile(object.path(), TinyView())).data == paint.data) return object.path();
  }
  throw std::runtime_error("no true mask is the paint");
}

// Mean absolute difference of two pictures, of 255 levels, over the pixels that `of` takes.
template <typename Of>
double MeanDifference(const Image8& a, const Image8& b, Of of) {
  double sum = 0;
  int64_t count = 0;
  for (size_t p = 0; p < a.NumPixels(); ++p) {
    if (!of(p)) continue;
    for (size_t c = 0; c < 3; ++c, ++count) {
      sum += std::abs(int(a.data[3 * p + c]) - int(b.data[3 * p + c]));
    }
  }
  return count == 0 ? 0 : sum / static_cast<double>(count);
}

// The results of --save-stages over all views, in levels: distance of the object's pixels from
// their targets, before (photo) and after; distance of all others from the photos.
struct Differences {
  double before = 0, after = 0, outside = 0;
};

Differences Measure(const std::filesystem::path& stages) {
  const std::filesystem::path truth = TruthFolder();
  Differences mean;
  int views = 0;
  for (const auto& file : std::filesystem::directory_iterator(truth)) {
    const std::string name = file.path().stem().string();  // of the view
    const Mask object = ReadMask(file.path());
    const Mask mask = ReadMask(ViewFile(stages / "masks", name));
    const Image8 photo = ReadImage8(TinyWorkspace() / "images" / name);
    const Image8 target = ReadImage8(ViewFile(stages / "targets", name));
    const Image8 result = ReadImage8(ViewFile(stages / "result", name));
    const auto inside = [&](size_t p) { return object.data[p] >= 128 && mask.data[p] >= 128; };
    mean.before += MeanDifference(photo, target, inside);
    mean.after += MeanDifference(result, target, inside);
    mean.outside += MeanDifference(
        result, photo, [&](size_t p) { return object.data[p] == 0 && mask.data[p] == 0; });
    ++views;
  }
  return {mean.before / views, mean.after / views, mean.outside / views};
}

TEST(Recolor, TakesSeveralPaintedViewsAndTheOtherSolvers) {
  TempFolder temp;
  const std::string second = ViewFile(TruthFolder(), "003.png").string();
  const CommandResult result =
      RunRetint(Join(RecolorArguments(temp), {"--view",         "003.png",
                                              "--mask",         second,
                                              "--set",          "solver=adam",
                                              "--set",          "iterations=20",
                                              "--target",       "photo",
                                              "--depth-method", "gaussian",
                                              "--set",          "projector=quads",
                                              "--set",          "register_cloud=false",
                                              "--report",       (temp / "r.json").string(),
                                              "--save-stages",  (temp / "stages").string()}));
  ASSERT_EQ(result.code, 0) << result.err;
  const json report = json::parse(ReadFile(temp / "r.json"));
  EXPECT_EQ(report["painted"].size(), 2u);
  EXPECT_EQ(report["refit"]["solver"], "adam");
  EXPECT_EQ(report["refit"]["iterations"], 20);
  EXPECT_EQ(report["depth"]["method"], "gaussian");
  EXPECT_EQ(report["registration"]["accepted"], false);
  // The object has its new color in the views' pixels, and the rest has kept its own. The closed
  // form, where adam starts, comes within a third of the change on this scene; its Gaussians are
  // as large as the objects' borders.
  const Differences differences = Measure(temp / "stages");
  EXPECT_GT(differences.before, 30);  // levels: the tint is strong
  EXPECT_LT(differences.after, 0.4 * differences.before);
  EXPECT_LT(differences.outside, 0.25 * differences.before);
}

TEST(Recolor, ThePaperPresetRunsAndFlagsWin) {
  TempFolder temp;
  const CommandResult result =
      RunRetint(Join(RecolorArguments(temp),
                     {"--preset", "paper", "--set", "iterations=150", "--set", "learning_rate=0.02",
                      "--set", "sample_fraction=0.6", "--report", (temp / "r.json").string(),
                      "--save-stages", (temp / "stages").string()}));
  ASSERT_EQ(result.code, 0) << result.err;
  const json report = json::parse(ReadFile(temp / "r.json"));
  const json& options = report["options"];
  EXPECT_EQ(options["depth_method"], "stereo-hv");
  EXPECT_EQ(options["stereo-hv"]["aggregate"], "min");
  for (const char* name : {"both_sides", "arbitrate", "subpixel"}) {
    EXPECT_EQ(options["stereo-hv"][name], false) << name;
  }
  EXPECT_EQ(options["register_cloud"], false);
  EXPECT_EQ(options["projector"], "quads");
  EXPECT_EQ(options["target"], "photo");
  EXPECT_EQ(options["solver"], "adam");
  EXPECT_EQ(options["adam"]["closed_form_start"], false);
  EXPECT_FALSE(options.contains("mm")) << "mm's options do not apply";
  // Given beside the preset.
  EXPECT_EQ(options["adam"]["iterations"], 150);
  EXPECT_EQ(options["adam"]["learning_rate"], 0.02);
  EXPECT_EQ(options["sample_fraction"], 0.6);
  EXPECT_EQ(report["refit"]["iterations"], 150);
  EXPECT_EQ(report["registration"]["reason"], "switched off");
  EXPECT_THAT(report["painted"][0]["depth"]["reason"].get<std::string>(),
              testing::HasSubstr("2 rendered pairs"));
  // From the original coefficients, with long steps, most of the way is done.
  const Differences differences = Measure(temp / "stages");
  EXPECT_GT(differences.before, 30);
  EXPECT_LT(differences.after, 0.5 * differences.before);
}

TEST(Recolor, IterationsZeroGoesOnUntilConverged) {
  TempFolder temp;
  json reports[2];
  const char* const limits[] = {"0", "999"};
  for (int i = 0; i < 2; ++i) {
    auto arguments = RecolorArguments(temp);
    arguments.back() = (temp / (std::string(limits[i]) + ".ply")).string();
    const CommandResult result = RunRetint(
        Join(arguments, {"--set", std::string("iterations=") + limits[i], "--set", "tolerance=1e-6",
                         "--report", (temp / "r.json").string(), "--quiet"}));
    ASSERT_EQ(result.code, 0) << result.err;
    reports[i] = json::parse(ReadFile(temp / "r.json"));
    EXPECT_EQ(reports[i]["refit"]["converged"], true);
  }
  EXPECT_GT(reports[0]["refit"]["iterations"], 12);  // the default's limit
  EXPECT_EQ(reports[0]["refit"]["iterations"], reports[1]["refit"]["iterations"]);
  EXPECT_TRUE(ReadFile(temp / "0.ply") == ReadFile(temp / "999.ply"));
}

TEST(Recolor, EvaluateGivesFiguresByTrueMasksToo) {
  TempFolder temp;
  const CommandResult made = RunRetint(
      Join(RecolorArguments(temp), {"--save-stages", (temp / "stages").string(), "--quiet"}));
  ASSERT_EQ(made.code, 0) << made.err;
  const auto evaluate = [&](const std::string& masks) {
    const CommandResult result = RunRetint(
        {"evaluate", TinyWorkspace().string(), "--splat", (TinyWorkspace() / "splat.ply").string(),
         "--after", (temp / "out.ply").string(), "--masks", masks, "--true-masks",
         TruthFolder().string(), "--tint", kTint, "--report", (temp / "r.json").string()});
    EXPECT_EQ(result.code, 0) << result.err;
    EXPECT_THAT(result.out, testing::HasSubstr("by the true masks"));
    return json::parse(ReadFile(temp / "r.json"));
  };
  const json own = evaluate((temp / "stages" / "masks").string());
  const json truth = evaluate(TruthFolder().string());
  EXPECT_EQ(truth["quality"], truth["true_masks"]["quality"]);
  EXPECT_EQ(truth["true_masks"]["mask_iou"], 1);
  EXPECT_EQ(own["true_masks"]["quality"], truth["quality"]);
  // As in ItsMasksAreTheObject: objects are small here.
  EXPECT_GT(own["true_masks"]["mask_iou"], 0.6);
  EXPECT_LT(own["true_masks"]["mask_iou"], 1);
  // Our own masks are soft and made to be met; the truth is harder.
  EXPECT_GT(own["quality"]["train"]["psnr_inside_after"].get<double>(),
            own["true_masks"]["quality"]["train"]["psnr_inside_after"].get<double>());
}

// Figures that are only printed are of some rows of pixels, and say so; those of a file are of all.
TEST(Recolor, SaysWhereItMeasuresSomeRowsOnly) {
  TempFolder temp;
  const std::string some = "in one row of pixels of 4";
  const CommandResult printed = RunRetint(RecolorArguments(temp));
  ASSERT_EQ(printed.code, 0) << printed.err;
  EXPECT_THAT(printed.out + printed.err, testing::HasSubstr(some));
  for (const auto& [option, file] :
       {std::pair("--report", "r.json"), {"--report-html", "r.html"}}) {
    const CommandResult kept =
        RunRetint(Join(RecolorArguments(temp), {option, (temp / file).string()}));
    ASSERT_EQ(kept.code, 0) << kept.err;
    EXPECT_THAT(kept.out + kept.err, testing::HasSubstr("fitted"));
    EXPECT_THAT(kept.out + kept.err, testing::Not(testing::HasSubstr(some)));
  }
}

// And of two dozen views.
TEST(Recolor, SaysWhereItMeasuresSomeViewsOnly) {
  TempFolder temp;
  const std::filesystem::path scene = temp / "scene";
  const CommandResult made = RunRetint({"synth", "--output", scene.string(), "--width", "80",
                                        "--height", "60", "--photos", "26", "--quiet"});
  ASSERT_EQ(made.code, 0) << made.err;
  const std::filesystem::path mask = std::filesystem::directory_iterator(scene / "masks")->path();
  const std::vector<std::string> recolor = {"recolor",  scene.string(),
                                            "--splat",  (scene / "splat.ply").string(),
                                            "--view",   mask.stem().string(),
                                            "--mask",   mask.string(),
                                            "--tint",   kTint,
                                            "--set",    "iterations=1",
                                            "--output", (temp / "out.ply").string()};
  const CommandResult printed = RunRetint(recolor);
  ASSERT_EQ(printed.code, 0) << printed.err;
  EXPECT_THAT(printed.out + printed.err, testing::HasSubstr("24 of 26 views: inside"));
  const CommandResult kept = RunRetint(Join(recolor, {"--report", (temp / "r.json").string()}));
  ASSERT_EQ(kept.code, 0) << kept.err;
  EXPECT_THAT(kept.out + kept.err, testing::HasSubstr("26 views: inside"));
  EXPECT_THAT(kept.out + kept.err, testing::Not(testing::HasSubstr("24 of 26 views")));
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
