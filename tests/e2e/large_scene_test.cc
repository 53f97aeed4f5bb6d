// SPDX-License-Identifier: BSD-3-Clause
// A splat opened in parts: the same bytes as when it is opened whole, within limits that are kept.
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <functional>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "base/files.h"
#include "colmap_io/image_io.h"
#include "colmap_io/workspace.h"
#include "kernels/backend.h"
#include "splat_io/splat_io.h"
#include "tests/benchmarks/densify.h"
#include "tests/e2e/command.h"
#include "tests/support/data.h"

namespace retint {
namespace {

using nlohmann::json;
using testing::HasSubstr;

class LargeSceneTest : public testing::Test {
 protected:
  CommandResult Recolor(const std::string& output, const std::vector<std::string>& more,
                        const std::string& report = "") {
    std::vector<std::string> arguments = {"recolor",  TinyWorkspace().string(),
                                          "--splat",  splat_.string(),
                                          "--view",   TinyView(),
                                          "--mask",   TinyMask().string(),
                                          "--tint",   "0.2,0.4,1.0",
                                          "--output", (temp_ / output).string()};
    if (!report.empty()) {
      arguments.insert(arguments.end(), {"--report", (temp_ / report).string()});
    }
    arguments.insert(arguments.end(), more.begin(), more.end());
    return RunRetint(arguments);
  }

  CommandResult Run(const std::string& verb, std::vector<std::string> more, bool in_parts) {
    std::vector<std::string> arguments = {verb, TinyWorkspace().string(), "--splat",
                                          splat_.string()};
    if (in_parts) arguments.insert(arguments.end(), {"--out-of-core", "on"});
    arguments.insert(arguments.end(), more.begin(), more.end());
    return RunRetint(arguments);
  }
  CommandResult Project(const std::string& masks, const std::vector<std::string>& more,
                        bool in_parts) {
    std::vector<std::string> arguments = {"--view",   TinyView(),
                                          "--mask",   TinyMask().string(),
                                          "--cloud",  (temp_ / "cloud.ply").string(),
                                          "--output", (temp_ / masks).string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return Run("project", arguments, in_parts);
  }
  void Select() {
    const CommandResult run = Run("select",
                                  {"--view", TinyView(), "--mask", TinyMask().string(), "--output",
                                   (temp_ / "cloud.ply").string()},
                                  false);
    ASSERT_EQ(run.code, 0) << run.err;
  }
  CommandResult Refit(const std::string& masks, const std::string& output, bool in_parts,
                      const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments = {"--masks",  (temp_ / masks).string(),
                                          "--tint",   "0.2,0.4,1.0",
                                          "--output", (temp_ / output).string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return Run("refit", arguments, in_parts);
  }
  void ExpectSameFit(const std::string& masks, const std::vector<std::string>& more = {}) {
    CommandResult run = Refit(masks, "whole.ply", false, more);
    ASSERT_EQ(run.code, 0) << run.err;
    run = Refit(masks, "parts.ply", true, more);
    ASSERT_EQ(run.code, 0) << run.err;
    EXPECT_THAT(run.out, HasSubstr("in parts"));
    EXPECT_EQ(ReadFile(temp_ / "parts.ply"), ReadFile(temp_ / "whole.ply"));
    EXPECT_NE(ReadFile(temp_ / "parts.ply"), ReadFile(splat_));
  }

  // The tiny scene, and behind its cameras Gaussians that no view sees.
  void SetUp() override {
    constexpr size_t kBehind = 1000;
    constexpr double kAway = 100;  // many times the scene's size
    GaussianModel model = ReadSplat(TinyWorkspace() / "splat.ply");
    const Reconstruction views = Workspace::Open(TinyWorkspace()).reconstruction;
    const Rigid3d& pose = views.ViewsByName().front()->cam_from_world;
    const Eigen::Vector3f behind = (pose.Inverse() * Eigen::Vector3d(0, 0, -kAway)).cast<float>();
    const size_t count = model.NumGaussians(), block = size_t(model.NumShCoeffs()) * 3;
    model.source = {};  // its columns have the old length
    model.Resize(count + kBehind, model.sh_degree);
    for (size_t i = 0; i < kBehind; ++i) {
      const size_t to = count + i;
      for (size_t c = 0; c < 3; ++c) {
        model.means[3 * to + c] = behind[Eigen::Index(c)] + 0.1F * model.means[3 * i + c];
        model.log_scales[3 * to + c] = model.log_scales[3 * i + c];
      }
      std::copy_n(&model.quats_wxyz[4 * i], 4, &model.quats_wxyz[4 * to]);
      model.opacity_logits[to] = model.opacity_logits[i];
      std::copy_n(&model.sh[i * block], block, &model.sh[to * block]);
    }
    WriteSplat(splat_, model);
  }

  TempFolder temp_;
  std::filesystem::path splat_ = temp_ / "splat.ply";
};

// The number behind the last flag of a refusal.
int Enough(const std::string& line, const std::string& flag = "--memory-mb ") {
  const size_t at = line.rfind(flag);
  EXPECT_NE(at, std::string::npos) << line;
  return at == std::string::npos ? 0 : std::stoi(line.substr(at + flag.size()));
}

TEST_F(LargeSceneTest, WritesTheSameBytesAsInCore) {
  const std::vector<std::string> off = {"--completion", "off"};
  CommandResult run = Recolor("whole.ply", off, "whole.json");
  ASSERT_EQ(run.code, 0) << run.err;
  run = Recolor("parts.ply", {"--completion", "off", "--out-of-core", "on"}, "parts.json");
  ASSERT_EQ(run.code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("in parts"));
  EXPECT_EQ(ReadFile(temp_ / "parts.ply"), ReadFile(temp_ / "whole.ply"));
  EXPECT_NE(ReadFile(temp_ / "parts.ply"), ReadFile(splat_));
  EXPECT_TRUE(std::filesystem::exists(temp_ / "splat.ply.index"));
  const json whole = json::parse(ReadFile(temp_ / "whole.json"));
  const json parts = json::parse(ReadFile(temp_ / "parts.json"));
  EXPECT_FALSE(whole.contains("out_of_core"));
  EXPECT_EQ(parts["gaussians"], whole["gaussians"]);
  EXPECT_EQ(parts["refit"], whole["refit"]);
  EXPECT_EQ(parts["masks"], whole["masks"]);
  EXPECT_EQ(parts["quality"]["train"], whole["quality"]["train"]);
  // A part it is: those behind the views are not in it.
  EXPECT_LT(parts["out_of_core"]["gaussians"].get<int64_t>(), whole["gaussians"].get<int64_t>());
  EXPECT_EQ(parts["out_of_core"]["views"], 8);
}

// Of a small scene the graph of all Gaussians completes a selection: all are opened.
TEST_F(LargeSceneTest, CompletesAsInCore) {
  CommandResult run = Recolor("whole.ply", {});
  ASSERT_EQ(run.code, 0) << run.err;
  run = Recolor("parts.ply", {"--out-of-core", "on"});
  ASSERT_EQ(run.code, 0) << run.err;
  EXPECT_EQ(ReadFile(temp_ / "parts.ply"), ReadFile(temp_ / "whole.ply"));
}

TEST_F(LargeSceneTest, ProjectsAsInCore) {
  Select();
  for (const std::string complete : {"off", "near"}) {
    const std::string whole = "whole-" + complete, parts = "parts-" + complete;
    CommandResult run = Project(whole, {"--completion", complete}, false);
    ASSERT_EQ(run.code, 0) << run.err;
    EXPECT_THAT(run.out, testing::Not(HasSubstr("in parts")));
    run = Project(parts, {"--completion", complete}, true);
    ASSERT_EQ(run.code, 0) << run.err;
    EXPECT_THAT(run.out, HasSubstr("in parts"));
    // A mask of each view, the shares and, of completed ones, how sure they are.
    const std::vector<std::string> names = FilesBelow(temp_ / whole);
    EXPECT_EQ(names.size(), complete == "off" ? 9U : 10U);
    ASSERT_EQ(FilesBelow(temp_ / parts), names);
    for (const std::string& name : names) {
      EXPECT_EQ(ReadFile(temp_ / parts / name), ReadFile(temp_ / whole / name)) << name;
    }
  }
}

TEST_F(LargeSceneTest, RefitsMasksAsInCore) {
  Select();
  const CommandResult run = Project("masks", {"--completion", "off"}, true);
  ASSERT_EQ(run.code, 0) << run.err;
  ExpectSameFit("masks");
  ExpectSameFit("masks", {"--target", "photo", "--holdout", "4"});
  // A view without selected pixels still tells which colors must stay. That holds with known
  // shares, and without them, after its mask was changed.
  WritePng(temp_ / "masks" / "003.png.png", Mask(160, 120));
  const CommandResult stale = Refit("masks", "stale.ply", true);
  EXPECT_THAT(stale.err, HasSubstr("belongs to other masks"));
  ExpectSameFit("masks");
  std::filesystem::remove(temp_ / "masks" / "shares.bin");
  std::filesystem::remove(temp_ / "masks" / "004.png.png");
  ExpectSameFit("masks");
}

// In a city of blocks, each one a scene, only parts that matter take part.
TEST_F(LargeSceneTest, ViewsThatSeeNothingSelectedTakeNoPartInAFit) {
  const auto report = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"--report", (temp_ / "report.json").string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const CommandResult run = Refit("masks", "out.ply", true, arguments);
    EXPECT_EQ(run.code, 0) << run.err;
    return json::parse(ReadFile(temp_ / "report.json"))["out_of_core"];
  };
  Select();
  ASSERT_EQ(Project("masks", {"--completion", "off"}, true).code, 0);
  EXPECT_EQ(report({})["views"], 8);
  EXPECT_EQ(report({"--most-views", "2"})["views"], 2);
  for (const char* name : {"003.png.png", "004.png.png"})
    std::filesystem::remove(temp_ / "masks" / name);
  EXPECT_EQ(report({})["views"], 6);
}

TEST_F(LargeSceneTest, RefusesToEvaluateAnotherSplat) {
  const auto object = std::filesystem::directory_iterator(TinyWorkspace() / "truth" / "masks");
  GaussianModel model = ReadSplat(splat_);
  model.means[3 * 700] += 1e-3F;
  WriteSplat(temp_ / "moved.ply", model);
  const CommandResult run =
      RunRetint({"evaluate", TinyWorkspace().string(), "--splat", splat_.string(), "--after",
                 (temp_ / "moved.ply").string(), "--masks", object->path().string(), "--tint",
                 "0.2,0.4,1.0", "--out-of-core", "on", "--progress", "none"});
  EXPECT_EQ(run.code, 3);
  EXPECT_THAT(run.err, HasSubstr("the means differ"));
}

TEST_F(LargeSceneTest, DescribesAsInCore) {
  const std::vector<std::string> all = {"--all", "--progress", "none"};
  const CommandResult whole = Run("info", all, false), parts = Run("info", all, true);
  ASSERT_EQ(whole.code, 0) << whole.err;
  ASSERT_EQ(parts.code, 0) << parts.err;
  EXPECT_THAT(whole.out, HasSubstr("8 of 8 views"));
  EXPECT_EQ(parts.out, whole.out);
  EXPECT_EQ(parts.err, whole.err);
  // Of a splat alone there are no views.
  const CommandResult alone = RunRetint({"info", splat_.string(), "--memory-mb", "1"});
  ASSERT_EQ(alone.code, 0) << alone.err;
  EXPECT_THAT(alone.out, HasSubstr("SH degree 3"));
  EXPECT_THAT(alone.out, testing::Not(HasSubstr("PSNR")));
}

TEST_F(LargeSceneTest, AFailureLeavesNoIndex) {
  const auto info = [&](const std::string& memory_mb) {
    return RunRetint({"info", TinyWorkspace().string(), "--splat", splat_.string(), "--backend",
                      "cpu", "--out-of-core", "on", "--memory-mb", memory_mb});
  };
  const std::filesystem::path index = temp_ / "splat.ply.index";
  CommandResult run = info("1");
  EXPECT_EQ(run.code, 2);
  EXPECT_THAT(run.err, HasSubstr("--memory-mb 1 is too little"));
  EXPECT_FALSE(std::filesystem::exists(index));
  EXPECT_EQ(info("0").code, 0);
  const std::string built = ReadFile(index);
  EXPECT_EQ(info("1").code, 2);
  EXPECT_EQ(ReadFile(index), built);  // of another command
}

TEST_F(LargeSceneTest, RebuildsAnIndexThatDoesNotFit) {
  const std::vector<std::string> options = {"--completion", "off",         "--out-of-core",
                                            "on",           "--log-level", "info"};
  CommandResult run = Recolor("first.ply", options);
  ASSERT_EQ(run.code, 0) << run.err;
  EXPECT_THAT(run.err, HasSubstr("built the index: there was no"));
  run = Recolor("second.ply", options);
  ASSERT_EQ(run.code, 0) << run.err;
  EXPECT_THAT(run.err, testing::Not(HasSubstr("built the index")));
  // Another splat of the same length.
  GaussianModel model = ReadSplat(splat_);
  for (float& value : model.sh) value *= 0.5F;
  WriteSplat(splat_, model);
  run = Recolor("third.ply", options);
  ASSERT_EQ(run.code, 0) << run.err;
  EXPECT_THAT(run.err, HasSubstr("was written after its index"));
  EXPECT_NE(ReadFile(temp_ / "third.ply"), ReadFile(temp_ / "second.ply"));
}

TEST_F(LargeSceneTest, TheCopyHasItsIndexAtOnce) {
  CommandResult run = Recolor("blue.ply", {"--completion", "off", "--out-of-core", "on"});
  ASSERT_EQ(run.code, 0) << run.err;
  EXPECT_TRUE(std::filesystem::exists(temp_ / "blue.ply.index"));
  run = RunRetint({"index", (temp_ / "blue.ply").string()});
  ASSERT_EQ(run.code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("fits the file"));
  // As the index that is built of it has.
  const auto render = [&](const std::string& folder) {
    const CommandResult one = RunRetint(
        {"render", TinyWorkspace().string(), "--splat", (temp_ / "blue.ply").string(), "--view",
         "003.png", "--output", (temp_ / folder).string(), "--out-of-core", "on"});
    EXPECT_EQ(one.code, 0) << one.err;
    return ReadFile(temp_ / folder / "003.png.png");
  };
  const std::string picture = render("copied");
  std::filesystem::remove(temp_ / "blue.ply.index");
  EXPECT_EQ(render("built"), picture);
  // The file in its place belongs to somebody.
  WriteFile(temp_ / "green.ply.index", "a list of books");
  run = Recolor("green.ply", {"--completion", "off", "--out-of-core", "on"});
  EXPECT_EQ(run.code, 0);
  EXPECT_THAT(run.err, HasSubstr("is not an index"));
  EXPECT_EQ(ReadFile(temp_ / "green.ply.index"), "a list of books");
}

TEST_F(LargeSceneTest, SaysWhatWouldFitAndWritesNothing) {
  const auto recolor = [&](int memory_mb) {
    return Recolor("out.ply",
                   {"--completion", "off", "--out-of-core", "on", "--memory-mb",
                    std::to_string(memory_mb), "--progress", "none"},
                   "report.json");
  };
  const CommandResult run = recolor(50);
  EXPECT_EQ(run.code, 2);
  EXPECT_EQ(CountLines(run.err), 1) << run.err;
  EXPECT_THAT(run.err, HasSubstr("--memory-mb 50 is too little"));
  EXPECT_FALSE(std::filesystem::exists(temp_ / "out.ply"));
  const int enough = Enough(run.err);
  const CommandResult again = recolor(enough);
  EXPECT_EQ(again.code, 0) << again.err;
  EXPECT_LE(json::parse(ReadFile(temp_ / "report.json"))["peak_rss_mb"], enough);
}

TEST_F(LargeSceneTest, IndexesWithinItsMemoryOrSaysWhatIsEnough) {
  const auto index = [&](int memory_mb) {
    return RunRetint({"index", splat_.string(), "--force", "--memory-mb", std::to_string(memory_mb),
                      "--progress", "none"});
  };
  CommandResult run = index(1);
  EXPECT_EQ(run.code, 2);
  EXPECT_EQ(CountLines(run.err), 1) << run.err;
  EXPECT_THAT(run.err, HasSubstr("--memory-mb 1 is too little to index"));
  EXPECT_FALSE(std::filesystem::exists(temp_ / "splat.ply.index"));
  const int enough = Enough(run.err);
  run = index(enough);
  ASSERT_EQ(run.code, 0) << run.err;
  const std::string peak = "peak memory ";
  const size_t at = run.out.find(peak);
  ASSERT_NE(at, std::string::npos) << run.out;
  EXPECT_LE(std::stoi(run.out.substr(at + peak.size())), enough);
}

// A few blocks of a city, each the tiny scene with many small Gaussians. Views see a part of them,
// and an edit takes more memory than the program itself.
class TiledSceneTest : public LargeSceneTest {
 protected:
  static constexpr size_t kTiles = 4;
  static constexpr int kChildren = 16;

  void SetUp() override {
    const GaussianModel block = [] {
      GaussianModel model = ReadSplat(TinyWorkspace() / "splat.ply");
      model.source = {};
      return Densify(model, kChildren, 1);
    }();
    const Reconstruction views = Workspace::Open(TinyWorkspace()).reconstruction;
    const Rigid3d& pose = views.ViewsByName().front()->cam_from_world;
    const Eigen::Vector3f back =
        (pose.rotation.conjugate() * Eigen::Vector3d(0, 0, -100)).cast<float>();
    const size_t count = block.NumGaussians(), width = size_t(block.NumShCoeffs()) * 3;
    GaussianModel city;
    city.Resize(kTiles * count, block.sh_degree);
    for (size_t g = 0; g < kTiles * count; ++g) {
      const size_t from = g % count, tile = g / count;
      for (size_t c = 0; c < 3; ++c) {
        city.means[3 * g + c] =
            block.means[3 * from + c] + float(tile) * back[static_cast<Eigen::Index>(c)];
        city.log_scales[3 * g + c] = block.log_scales[3 * from + c];
      }
      std::copy_n(&block.quats_wxyz[4 * from], 4, &city.quats_wxyz[4 * g]);
      city.opacity_logits[g] = block.opacity_logits[from];
      std::copy_n(&block.sh[from * width], width, &city.sh[g * width]);
    }
    WriteSplat(splat_, city);
  }

  // The report of a run within a limit; null where it is refused, `err` says why.
  json RunWithin(int memory_mb, std::vector<std::string> more, std::string* err) {
    std::vector<std::string> arguments = {"--completion", "off",         "--out-of-core",
                                          "on",           "--memory-mb", std::to_string(memory_mb),
                                          "--progress",   "none"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const CommandResult run = Recolor("out.ply", arguments, "report.json");
    *err = run.err;
    if (run.code == 2) return {};
    EXPECT_EQ(run.code, 0) << run.err;
    return json::parse(ReadFile(temp_ / "report.json"));
  }
};

TEST_F(TiledSceneTest, KeepsWithinItsMemoryOrSaysWhatIsEnough) {
  std::string err;
  for (const std::vector<std::string>& edit :
       {std::vector<std::string>{}, {"--target", "photo", "--gamma", "1.6"}}) {
    const json free = RunWithin(16000, edit, &err);
    ASSERT_TRUE(free.contains("peak_rss_mb")) << err;
    // Much less memory than the first stage takes: rejected, with the memory in the message.
    EXPECT_TRUE(RunWithin(150, edit, &err).is_null());
    const int most = Enough(err);
    const json within = RunWithin(most, edit, &err);
    ASSERT_TRUE(within.contains("peak_rss_mb")) << err;
    EXPECT_LE(within["peak_rss_mb"], most);
    // Between the two it may be refused once more, with a figure that is kept.
    const json between = RunWithin((150 + most) / 2, edit, &err);
    if (!between.is_null()) {
      EXPECT_LE(between["peak_rss_mb"], (150 + most) / 2);
    } else {
      const int enough = Enough(err);
      const json kept = RunWithin(enough, edit, &err);
      ASSERT_TRUE(kept.contains("peak_rss_mb")) << err;
      EXPECT_LE(kept["peak_rss_mb"], enough);
    }
  }
}

TEST_F(TiledSceneTest, KeepsWithinBothMemoriesBesideAGpu) {
  if (!CudaFault().empty()) GTEST_SKIP() << "CUDA: " << CudaFault();
  const auto run = [&](int memory_mb, int device_mb, std::string* err) {
    return RunWithin(memory_mb,
                     {"--backend", "cuda", "--device-memory-mb", std::to_string(device_mb)}, err);
  };
  std::string err;
  EXPECT_TRUE(run(1, 1, &err).is_null());
  EXPECT_EQ(CountLines(err), 1) << err;
  EXPECT_THAT(err, HasSubstr("--memory-mb 1 and --device-memory-mb 1 are too little"));
  const int memory_mb = Enough(err), device_mb = Enough(err, "--device-memory-mb ");
  const json within = run(memory_mb, device_mb, &err);
  ASSERT_TRUE(within.contains("peak_device_mb")) << err;
  EXPECT_LE(within["peak_rss_mb"], memory_mb);
  EXPECT_LE(within["peak_device_mb"], device_mb);
  EXPECT_GT(within["peak_device_mb"], 1);
}

// Every figure, bit for bit; of some views at a time where memory is tight.
TEST_F(TiledSceneTest, EvaluatesAsInCore) {
  GaussianModel model = ReadSplat(splat_);
  for (size_t i = 0; i < model.sh.size(); i += 7) model.sh[i] += 0.1F;
  WriteSplat(temp_ / "blue.ply", model);
  const auto object = std::filesystem::directory_iterator(TinyWorkspace() / "truth" / "masks");
  std::filesystem::copy(object->path(), temp_ / "masks");
  // Masks that differ, of fewer views, and one that is empty.
  std::filesystem::copy(object->path(), temp_ / "truth");
  std::filesystem::remove(ViewFile(temp_ / "truth", "001.png"));
  Mask mask = ReadMask(ViewFile(temp_ / "masks", "003.png"));
  std::fill(mask.data.begin(), mask.data.begin() + 3000, uint8_t{255});
  WritePng(ViewFile(temp_ / "truth", "003.png"), mask);
  WritePng(ViewFile(temp_ / "truth", "005.png"), Mask(mask.width, mask.height));
  const auto evaluate = [&](std::vector<std::string> more, json* report) {
    std::vector<std::string> arguments = {
        "evaluate",     TinyWorkspace().string(),         "--splat",    splat_.string(),
        "--after",      (temp_ / "blue.ply").string(),    "--masks",    (temp_ / "masks").string(),
        "--true-masks", (temp_ / "truth").string(),       "--holdout",  "3",
        "--report",     (temp_ / "report.json").string(), "--progress", "none"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    CommandResult result = RunRetint(arguments);
    if (result.code == 0) *report = json::parse(ReadFile(temp_ / "report.json"));
    return result;
  };
  for (const std::vector<std::string>& edit :
       {std::vector<std::string>{"--tint", "0.2,0.4,1.0"},
        // Whose color is measured.
        {"--to", "#3060ff", "--target", "photo", "--strength", "0.7"}}) {
    json whole, parts;
    CommandResult run = evaluate(edit, &whole);
    ASSERT_EQ(run.code, 0) << run.err;
    std::vector<std::string> tight = edit;
    tight.insert(tight.end(), {"--out-of-core", "on", "--memory-mb", "1"});
    run = evaluate(tight, &parts);
    ASSERT_EQ(run.code, 2) << run.err;
    tight.back() = std::to_string(Enough(run.err));
    run = evaluate(tight, &parts);
    ASSERT_EQ(run.code, 0) << run.err;
    EXPECT_THAT(run.out, HasSubstr("in parts"));
    EXPECT_LE(parts["peak_rss_mb"], std::stoi(tight.back()));
    ASSERT_FALSE(whole["true_masks"].is_null());
    for (const char* what :
         {"quality", "true_masks", "refit", "masks", "sh_range", "edit", "gaussians"}) {
      EXPECT_EQ(parts[what], whole[what]) << what;
    }
  }
}

TEST_F(LargeSceneTest, RefusesWhatIsNotToBeHadInParts) {
  CommandResult run = Recolor("out.spz", {"--out-of-core", "on"});
  EXPECT_EQ(run.code, 2);
  EXPECT_THAT(run.err, HasSubstr("must be a 3DGS .ply"));
  run = Recolor("out.ply", {"--out-of-core", "on", "--save-stages", (temp_ / "stages").string()});
  EXPECT_EQ(run.code, 2);
  EXPECT_THAT(run.err, HasSubstr("needs all views of the scene"));
  EXPECT_FALSE(std::filesystem::exists(temp_ / "out.ply"));
}

// During the edit; an old output stays.
TEST_F(LargeSceneTest, NoticesThatTheSplatChanges) {
  WriteFile(temp_ / "out.ply", "what was there");
  const std::string bytes = ReadFile(splat_);
  const auto recolor_while = [&](const std::function<void()>& change) {
    bool changed = false;
    CommandOptions options;
    options.interrupt_when = [&](const std::string& err) {
      if (!changed && err.find("\"stage\":\"depth\"") != std::string::npos) {
        change();
        changed = true;
      }
      return false;  // it is not interrupted
    };
    CommandResult run =
        RunRetint({"recolor", TinyWorkspace().string(), "--splat", splat_.string(), "--view",
                   TinyView(), "--mask", TinyMask().string(), "--tint", "0.2,0.4,1.0", "--output",
                   (temp_ / "out.ply").string(), "--completion", "off", "--out-of-core", "on",
                   "--progress", "json"},
                  options);
    EXPECT_TRUE(changed) << run.err;
    EXPECT_EQ(ReadFile(temp_ / "out.ply"), "what was there");
    EXPECT_FALSE(std::filesystem::exists(temp_ / "out.ply.index"));
    return run;
  };
  CommandResult run = recolor_while([&] {
    std::filesystem::last_write_time(
        splat_, std::filesystem::last_write_time(splat_) + std::chrono::seconds(5));
  });
  EXPECT_EQ(run.code, 3);
  EXPECT_THAT(run.err, HasSubstr("changed while it was in use"));
  run = recolor_while([&] { std::filesystem::resize_file(splat_, bytes.size() / 2); });
  EXPECT_EQ(run.code, 3) << run.err;  // an error of reading, or the same as above
}

TEST_F(LargeSceneTest, AFullDiskUnderIndexOrOutputLosesNothing) {
  WriteFile(temp_ / "out.ply", "what was there");
  const auto recolor = [&](int64_t max_file_bytes) {
    CommandOptions options;
    options.max_file_bytes = max_file_bytes;
    return RunRetint(
        {"recolor", TinyWorkspace().string(), "--splat", splat_.string(), "--view", TinyView(),
         "--mask", TinyMask().string(), "--tint", "0.2,0.4,1.0", "--output",
         (temp_ / "out.ply").string(), "--completion", "off", "--out-of-core", "on"},
        options);
  };
  EXPECT_EQ(recolor(500).code, 4);
  EXPECT_FALSE(std::filesystem::exists(temp_ / "splat.ply.index"));
  EXPECT_EQ(recolor(static_cast<int64_t>(std::filesystem::file_size(splat_)) - 1).code, 4);
  EXPECT_EQ(ReadFile(temp_ / "out.ply"), "what was there");
  EXPECT_EQ(recolor(-1).code, 0);
}

}  // namespace
}  // namespace retint
