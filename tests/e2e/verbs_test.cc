// SPDX-License-Identifier: BSD-3-Clause
// The other verbs, on good input.
#include <cctype>
#include <cmath>
#include <cstring>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "base/files.h"
#include "colmap_io/depth_map_io.h"
#include "colmap_io/image_io.h"
#include "kernels/backend.h"
#include "selection/selection_cloud.h"
#include "splat_io/splat_io.h"
#include "tests/e2e/command.h"
#include "tests/support/data.h"

namespace retint {
namespace {

namespace fs = std::filesystem;
using testing::EndsWith;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

std::vector<std::string> With(const std::string& verb, const std::vector<std::string>& more) {
  std::vector<std::string> arguments = {verb, TinyWorkspace().string(), "--splat",
                                        (TinyWorkspace() / "splat.ply").string()};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

// The list of `retint --help` below "Subcommands:", one name per line.
std::vector<std::string> Verbs() {
  std::istringstream help(RunRetint({"-h"}).out);
  std::string line;
  std::vector<std::string> verbs;
  while (std::getline(help, line) && line != "Examples:") {
    std::string verb;
    std::istringstream(line) >> verb;
    if (line.starts_with("  " + verb) && std::islower(static_cast<unsigned char>(verb[0])) != 0) {
      verbs.push_back(verb);
    }
  }
  return verbs;
}

TEST(Verbs, EveryVerbHasHelp) {
  const std::vector<std::string> verbs = Verbs();
  EXPECT_THAT(verbs, testing::IsSupersetOf({"info", "render", "recolor", "run", "synth"}));
  for (const std::string& verb : verbs) {
    for (const char* help : {"-h", "--help"}) {
      const CommandResult own = RunRetint({verb, help});
      EXPECT_EQ(own.code, 0);
      EXPECT_EQ(own.err, "");
      EXPECT_THAT(own.out, HasSubstr("Usage: retint " + verb)) << help;
    }
  }
  const std::string all = RunRetint({"--help"}).out;
  for (const char* option :
       {"--backend", "--threads", "--seed", "--log-level", "--quiet", "--progress", "--verbose"}) {
    EXPECT_THAT(all, HasSubstr(option));
  }
}

// One screen for people; options that nobody needs are no flags, and still there.
TEST(Verbs, HelpHasTiers) {
  const std::string brief = RunRetint({"recolor", "-h"}).out;
  const std::string whole = RunRetint({"recolor", "--help"}).out;
  EXPECT_LE(CountLines(brief), 50);
  const auto flags = [](const std::string& help) {
    int count = 0;
    std::istringstream lines(help);
    for (std::string line; std::getline(lines, line);) {
      count += line.starts_with("  -") || line.starts_with("  SCENE") ? 1 : 0;
    }
    return count;
  };
  EXPECT_GE(flags(brief), 20);
  EXPECT_LE(flags(brief), 27);
  EXPECT_GT(flags(whole), flags(brief));
  EXPECT_THAT(brief, HasSubstr("Examples:"));
  EXPECT_THAT(whole, Not(HasSubstr("--ridge")));
  EXPECT_THAT(RunRetint({"options"}).out, HasSubstr("mm.ridge_rest"));
  EXPECT_THAT(RunRetint({"options", "ridge_rest"}).out, HasSubstr("--set mm.ridge_rest=0.001"));
  EXPECT_EQ(RunRetint({"options", "ridge_rust"}).code, 2);
}

TEST(Verbs, TheDocumentationListsWhatHelpPrints) {
  const std::string doc = ReadFile(fs::path(RETINT_SOURCE_DIR) / "docs/cli.md");
  const auto expect_listed = [&](const std::string& marker, CommandResult printed) {
    while (printed.out.ends_with('\n')) printed.out.pop_back();
    EXPECT_NE(doc.find("<!-- " + marker + "-->\n```text\n" + printed.out + "\n```\n"),
              std::string::npos)
        << marker << ": run bash apps/update_cli_doc.sh";
  };
  expect_listed("help: ", RunRetint({"--help"}));
  for (const std::string& name : Verbs()) {
    expect_listed("help: " + name + " ", RunRetint({name, "--help"}));
  }
  expect_listed("output: options ", RunRetint({"options"}));
}

TEST(Verbs, VersionNamesBackendsAndLibraries) {
  const CommandResult result = RunRetint({"--version"});
  EXPECT_EQ(result.code, 0);
  for (const char* part : {"retint ", "cpu", "Eigen 3", "Ceres ", "PCL ", "OpenCV ", "oneTBB ",
                           "Highway ", "CLI11 ", "spdlog ", "nlohmann-json "}) {
    EXPECT_THAT(result.out, HasSubstr(part));
  }
  EXPECT_THAT(result.out, Not(HasSubstr(" ,"))) << "a library without a version";
  const std::string fault = CudaFault();
  EXPECT_THAT(result.out, HasSubstr(fault.empty() ? "; cuda (" : "; cuda: " + fault + "\n"));
}

TEST(Verbs, TheFirstLogLineSaysWhichBackendRunsAndWhy) {
  const auto first_line = [](const std::string& backend) {
    const CommandResult result = RunRetint(
        With("info", {"--progress", "none", "--log-level", "info", "--backend", backend}));
    EXPECT_EQ(result.code, 0) << result.err;
    return result.err.substr(0, result.err.find('\n'));
  };
  EXPECT_THAT(first_line("cpu"), StartsWith("retint: info: backend cpu ("));
  EXPECT_THAT(first_line("cpu"), Not(HasSubstr("cuda"))) << "nothing was left to choose";
  const std::string fault = CudaFault();
  if (fault.empty()) {
    EXPECT_THAT(first_line("auto"), StartsWith("retint: info: backend cuda ("));
  } else {
    EXPECT_THAT(first_line("auto"), StartsWith("retint: info: backend cpu ("));
    EXPECT_THAT(first_line("auto"), EndsWith("; cuda: " + fault));
    const CommandResult asked = RunRetint(With("info", {"--backend", "cuda"}));
    EXPECT_EQ(asked.code, 2);
    EXPECT_THAT(asked.err, HasSubstr("cannot be used: " + fault));
  }
}

TEST(Verbs, InfoComparesRendersWithPhotos) {
  const CommandResult result = RunRetint(With("info", {"--progress", "none"}));
  EXPECT_EQ(result.code, 0);
  EXPECT_EQ(result.err, "") << "a splat in the workspace's frame needs no warning";
  for (const char* part : {"PINHOLE 160x120", "8, photos of 8", "SH degree 3", "PSNR"}) {
    EXPECT_THAT(result.out, HasSubstr(part));
  }
}

TEST(Verbs, InfoWarnsOfASplatInAnotherFrame) {
  TempFolder temp;
  GaussianModel model = ReadSplat(TinyWorkspace() / "splat.ply");
  // Upside down and back to front, as a splat trained in another tool's frame is.
  for (size_t g = 0; g < model.NumGaussians(); ++g) {
    model.means[3 * g + 1] *= -1;
    model.means[3 * g + 2] *= -1;
  }
  WriteSplat(temp / "turned.ply", model);
  const CommandResult result = RunRetint({"info", TinyWorkspace().string(), "--splat",
                                          (temp / "turned.ply").string(), "--progress", "none"});
  EXPECT_EQ(result.code, 0);
  EXPECT_THAT(result.err, HasSubstr("another frame"));
  EXPECT_EQ(CountLines(result.err), 1);
}

TEST(Verbs, InfoDoesWithoutPhotosAndWithoutASplat) {
  TempFolder temp;
  fs::copy(TinyWorkspace() / "sparse", temp / "sparse", fs::copy_options::recursive);
  CommandResult result = RunRetint(
      {"info", temp.path().string(), "--splat", (TinyWorkspace() / "splat.ply").string()});
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("8, photos of 0"));
  EXPECT_THAT(result.out, HasSubstr("no photos"));
  result = RunRetint({"info", temp.path().string()});
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(result.out, Not(HasSubstr("Gaussians")));
  // Only views with photos count as compared.
  fs::create_directories(temp / "images");
  fs::copy(TinyWorkspace() / "images" / TinyView(), temp / "images");
  result = RunRetint(
      {"info", temp.path().string(), "--splat", (TinyWorkspace() / "splat.ply").string()});
  EXPECT_THAT(result.out, HasSubstr("median of 1 of 8 views against their photos"));
}

TEST(Verbs, InfoNeedsSomethingToDescribe) {
  const CommandResult result = RunRetint({"info"});
  EXPECT_EQ(result.code, 2);
  EXPECT_THAT(result.err, HasSubstr("SCENE is required"));
}

TEST(Verbs, RenderWritesWhatIsAskedFor) {
  TempFolder temp;
  CommandResult result =
      RunRetint(With("render", {"--view", "000.png", "--view", "003.png", "--output",
                                (temp / "a").string(), "--what", "rgb,depth,alpha", "--quiet"}));
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(FilesBelow(temp / "a"),
              testing::UnorderedElementsAre("000.png.png", "000.png.depth.bin", "000.png.depth.png",
                                            "000.png.alpha.png", "003.png.png", "003.png.depth.bin",
                                            "003.png.depth.png", "003.png.alpha.png"));
  const Image render = ReadImage(temp / "a/000.png.png");
  const Image photo = ReadImage(TinyWorkspace() / "images/000.png");
  double error = 0;
  for (size_t i = 0; i < render.data.size(); ++i) {
    error += std::pow(render.data[i] - photo.data[i], 2);
  }
  EXPECT_GT(-10 * std::log10(error / static_cast<double>(render.data.size())), 18);
  result = RunRetint(With("render", {"--all", "--output", (temp / "b").string(), "--quiet"}));
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(FilesBelow(temp / "b").size(), 8u);
}

TEST(Verbs, DepthIsNearTheTruth) {
  TempFolder temp;
  const DepthMap truth = ReadDepthMap(TinyWorkspace() / "truth/depth/000.png.bin");
  for (const char* method : {"gaussian", "stereo-hv"}) {
    const std::string map = (temp / (std::string(method) + ".bin")).string();
    const CommandResult result =
        RunRetint(With("depth", {"--view", "000.png", "--depth-method", method, "--output", map,
                                 "--png", map + ".png"}));
    ASSERT_EQ(result.code, 0) << result.err;
    EXPECT_THAT(result.out, HasSubstr(method));
    const DepthMap depth = ReadDepthMap(map);
    ASSERT_EQ(depth.width, truth.width);
    std::vector<double> errors;
    for (size_t i = 0; i < depth.data.size(); ++i) {
      if (depth.data[i] > 0 && truth.data[i] > 0) {
        errors.push_back(std::abs(depth.data[i] / truth.data[i] - 1));
      }
    }
    ASSERT_GT(errors.size(), depth.data.size() / 2);
    std::nth_element(errors.begin(), errors.begin() + errors.size() / 2, errors.end());
    // The verb writes the right map in the right place; accuracy is the estimators' own tests'.
    EXPECT_LT(errors[errors.size() / 2], 0.05) << method;
    EXPECT_TRUE(fs::exists(map + ".png"));
  }
}

TEST(Verbs, DepthReadsDenseMapsOfTheWorkspace) {
  TempFolder temp;
  fs::copy(TinyWorkspace() / "sparse", temp / "sparse", fs::copy_options::recursive);
  fs::create_directories(temp / "stereo/depth_maps");
  fs::copy(TinyWorkspace() / "truth/depth/000.png.bin",
           temp / "stereo/depth_maps/000.png.geometric.bin");
  const CommandResult result = RunRetint(
      {"depth", temp.path().string(), "--splat", (TinyWorkspace() / "splat.ply").string(), "--view",
       "000.png", "--depth-method", "colmap", "--output", (temp / "d.bin").string()});
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(ReadDepthMap(temp / "d.bin").data,
            ReadDepthMap(TinyWorkspace() / "truth/depth/000.png.bin").data);
}

TEST(Verbs, DepthPrintsItsErrorsAgainstSparsePoints) {
  // The truth's own map: the sample's sparse points lie on its surfaces.
  TempFolder temp;
  fs::copy(TinyWorkspace() / "sparse", temp / "sparse", fs::copy_options::recursive);
  fs::create_directories(temp / "stereo/depth_maps");
  DepthMap map = ReadDepthMap(TinyWorkspace() / "truth/depth/000.png.bin");
  for (float& z : map.data) z *= 1.25f;
  WriteDepthMap(temp / "stereo/depth_maps/000.png.geometric.bin", map);
  const CommandResult result = RunRetint(
      {"depth", temp.path().string(), "--splat", (TinyWorkspace() / "splat.ply").string(), "--view",
       "000.png", "--depth-method", "colmap", "--against", "sparse", "--progress", "none"});
  ASSERT_EQ(result.code, 0) << result.err;
  std::smatch found;
  ASSERT_TRUE(std::regex_search(result.out, found,
                                std::regex("error +median ([0-9.]+) %, 90 % up to ([0-9.]+) %")))
      << result.out;
  // 25 %, but for the steps of depth within a pixel of this small picture.
  EXPECT_NEAR(std::stod(found[1]), 25, 2) << result.out;
  EXPECT_GE(std::stod(found[2]), std::stod(found[1]));
  EXPECT_TRUE(std::regex_search(result.out, std::regex("sparse points: [1-9][0-9]+ seen, [1-9]")));
  EXPECT_TRUE(std::regex_search(result.out, std::regex("bias +\\+2[0-9]"))) << result.out;
  const CommandResult neither = RunRetint(With("depth", {"--view", "000.png"}));
  EXPECT_EQ(neither.code, 2);
  EXPECT_THAT(neither.err, HasSubstr("--against"));
}

// A script that plays COLMAP: it leaves the truth as its depth map.
TEST(Verbs, DepthRunsColmapWhereItIs) {
  TempFolder temp;
  const fs::path colmap = temp / "my colmap";
  WriteFile(colmap, "#!/bin/sh\ncp '" + (TinyWorkspace() / "truth/depth/000.png.bin").string() +
                        "' \"$3/stereo/depth_maps/view.png.photometric.bin\"\n");
  fs::permissions(colmap, fs::perms::owner_all);
  CommandResult result = RunRetint(
      With("depth", {"--view", "000.png", "--depth-method", "colmap-mvs", "--colmap-program",
                     colmap.string(), "--output", (temp / "d.bin").string()}));
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("colmap-mvs: "));
  EXPECT_EQ(ReadDepthMap(temp / "d.bin").data,
            ReadDepthMap(TinyWorkspace() / "truth/depth/000.png.bin").data);

  WriteFile(colmap, "#!/bin/sh\necho 'ERROR: Dense stereo reconstruction requires CUDA'\nexit 1\n");
  fs::permissions(colmap, fs::perms::owner_all);  // it is a new file
  result = RunRetint(
      With("depth", {"--view", "000.png", "--depth-method", "colmap-mvs", "--colmap-program",
                     colmap.string(), "--against", "sparse", "--progress", "none"}));
  EXPECT_EQ(result.code, 4);
  EXPECT_EQ(CountLines(result.err), 1) << result.err;
  EXPECT_THAT(result.err, HasSubstr("was built without CUDA"));
  result = RunRetint(
      With("depth", {"--view", "000.png", "--depth-method", "colmap-mvs", "--colmap-program",
                     (temp / "none").string(), "--against", "sparse"}));
  EXPECT_EQ(result.code, 2);
  EXPECT_THAT(result.err, HasSubstr((temp / "none").string()));
}

TEST(Verbs, SelectionsGrowAndAreErased) {
  TempFolder temp;
  const std::string first = (temp / "first.ply").string(), both = (temp / "both.ply").string(),
                    erased = (temp / "erased.ply").string();
  ASSERT_EQ(RunRetint(With("select", {"--view", TinyView(), "--mask", TinyMask().string(),
                                      "--output", first, "--quiet"}))
                .code,
            0);
  const size_t count = ReadCloud(first).points.size();
  ASSERT_GT(count, 50u);
  ASSERT_EQ(RunRetint(With("select", {"--view", TinyView(), "--mask", TinyMask().string(),
                                      "--append", first, "--output", both, "--quiet"}))
                .code,
            0);
  EXPECT_EQ(ReadCloud(both).points.size(), 2 * count);
  // The left half of the picture erased.
  const SelectionCloud cloud = ReadCloud(first);
  int middle = 0;
  for (const SelectionPoint& point : cloud.points) middle += point.x;
  middle /= static_cast<int>(count);
  Mask half(160, 120);
  for (int y = 0; y < 120; ++y) {
    for (int x = 0; x < middle; ++x) half(x, y) = 255;
  }
  WritePng(temp / "half.png", half);
  const CommandResult result =
      RunRetint(With("select", {"--view", TinyView(), "--append", first, "--erase",
                                (temp / "half.png").string(), "--output", erased}));
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("erased"));
  const size_t left = ReadCloud(erased).points.size();
  EXPECT_LT(left, count * 7 / 10);
  EXPECT_GT(left, count * 3 / 10);
}

TEST(Verbs, RefineSplitsWhatIsInsideMasks) {
  TempFolder temp;
  const fs::path finer = temp / "finer.ply", same = temp / "same.ply";
  const std::string masks = (TinyWorkspace() / "truth" / "masks" / "box").string();
  const CommandResult result = RunRetint(
      With("refine", {"--masks", masks, "--set", "refine.pixels=0.5", "--output", finer}));
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("Gaussians split into"));
  EXPECT_THAT(result.out, HasSubstr("dB from the splat as it was"));
  const size_t before = ReadSplat(TinyWorkspace() / "splat.ply").NumGaussians();
  EXPECT_GT(ReadSplat(finer).NumGaussians(), before);
  const CommandResult few =
      RunRetint(With("refine", {"--masks", masks, "--set", "refine.pixels=0.5", "--set",
                                "refine.most=200", "--output", finer}));
  ASSERT_EQ(few.code, 0) << few.err;
  EXPECT_THAT(few.err, HasSubstr("parts of 0.5 pixels would be more than 200"));
  EXPECT_THAT(few.err, HasSubstr("allow more parts (--set refine.most)"));
  const CommandResult coarse =
      RunRetint(With("refine", {"--masks", masks, "--set", "refine.pixels=100", "--output", same}));
  ASSERT_EQ(coarse.code, 0) << coarse.err;
  EXPECT_THAT(coarse.err, HasSubstr("the splat is as it was"));
  EXPECT_EQ(ReadSplat(same).NumGaussians(), before);
}

TEST(Verbs, ProgressAsJsonIsOneObjectALine) {
  TempFolder temp;
  const CommandResult result = RunRetint(With(
      "render", {"--view", "000.png", "--output", (temp / "a").string(), "--progress", "json"}));
  ASSERT_EQ(result.code, 0);
  std::istringstream lines(result.err);
  std::string line;
  int count = 0;
  while (std::getline(lines, line)) {
    const auto parsed = nlohmann::json::parse(line);
    EXPECT_TRUE(parsed["stage"].is_string());
    EXPECT_GE(parsed["fraction"], 0);
    EXPECT_LE(parsed["fraction"], 1);
    ++count;
  }
  EXPECT_GE(count, 3);
}

// The workspace has no photos, which is warned of.
TEST(Verbs, WarningsAndErrorsAreJsonBesideProgressAsJson) {
  TempFolder temp;
  const auto levels = [](const std::string& err) {
    std::vector<std::string> found;
    std::istringstream lines(err);
    for (std::string line; std::getline(lines, line);) {
      const auto parsed = nlohmann::json::parse(line, nullptr, false);
      EXPECT_TRUE(parsed.is_object()) << line;
      if (parsed.is_object() && parsed.contains("level"))
        found.push_back(parsed["level"].get<std::string>());
    }
    return found;
  };
  fs::copy(TinyWorkspace() / "sparse", temp / "sparse", fs::copy_options::recursive);
  const CommandResult warned =
      RunRetint({"recolor", temp.path().string(), "--splat",
                 (TinyWorkspace() / "splat.ply").string(), "--view", TinyView(), "--mask",
                 TinyMask().string(), "--tint", "#3060ff", "--target", "photo", "--set",
                 "iterations=1", "--output", (temp / "o.ply").string(), "--progress", "json"});
  EXPECT_EQ(warned.code, 0) << warned.err;
  EXPECT_THAT(levels(warned.err), testing::Contains("warning"));
  const CommandResult informed =
      RunRetint(With("render", {"--view", "nope", "--output", (temp / "a").string(),
                                "--progress=json", "--log-level", "info"}));
  EXPECT_EQ(informed.code, 3);
  EXPECT_THAT(levels(informed.err), testing::ElementsAre("info", "error"));
  // Of a command line that cannot be understood, too.
  const std::vector<std::vector<std::string>> wrongs = {{"render", "--progress", "json", "--wrong"},
                                                        {"wrong", "--progress", "json"}};
  for (const std::vector<std::string>& wrong : wrongs) {
    const CommandResult refused = RunRetint(wrong);
    EXPECT_EQ(CountLines(refused.err), 1) << refused.err;
    const auto error = nlohmann::json::parse(refused.err);
    EXPECT_EQ(error["level"], "error");
    EXPECT_EQ(error["code"], 2);
    EXPECT_THAT(error["message"].get<std::string>(), HasSubstr("wrong"));
  }
}

TEST(Verbs, TheTotalOfTheProgressNeverFallsAndHasNoGaps) {
  TempFolder temp;
  for (const std::vector<std::string>& arguments :
       {With("recolor", {"--view", TinyView(), "--mask", TinyMask().string(), "--tint", "#3060ff",
                         "--output", (temp / "o.ply").string()}),
        With("suggest", {"--view", TinyView(), "--mask", TinyMask().string()}),
        With("render", {"--all", "--output", (temp / "r").string()})}) {
    std::vector<std::string> more = arguments;
    more.insert(more.end(), {"--progress", "json"});
    const CommandResult result = RunRetint(more);
    ASSERT_EQ(result.code, 0) << result.err;
    std::istringstream lines(result.err);
    double last = 0;
    std::string stage = "the start";
    for (std::string line; std::getline(lines, line);) {
      const auto parsed = nlohmann::json::parse(line);
      if (!parsed.contains("total")) continue;
      const double total = parsed["total"];
      EXPECT_GE(total, last) << line;
      // Of a stage that is missing in the plan or comes in another place, the others' shares are
      // jumped over. The longest stage that reports nothing in between has less. Within a stage a
      // fast machine may report the beginning and the end alone.
      const std::string name = parsed["stage"];
      if (name != stage) {
        EXPECT_LE(total - last, 0.45) << arguments[0] << ": from " << stage << " to " << line;
      }
      last = total;
      stage = name;
    }
    EXPECT_EQ(last, 1);
  }
}

TEST(Verbs, PaletteSaysIfItFoundFewerColorsThanAsked) {
  const auto palette = [](const char* colors) {
    return RunRetint(With("palette", {"--view", TinyView(), "--mask", TinyMask().string(),
                                      "--colors", colors, "--progress", "none"}));
  };
  const CommandResult many = palette("16");
  ASSERT_EQ(many.code, 0) << many.err;
  EXPECT_THAT(many.out, HasSubstr(" of at most 16 colors found"));
  EXPECT_THAT(palette("1").out, Not(HasSubstr("at most")));
}

TEST(Verbs, QuietSaysNothing) {
  TempFolder temp;
  const CommandResult result = RunRetint(
      With("render", {"--view", "000.png", "--output", (temp / "a").string(), "--quiet"}));
  EXPECT_EQ(result.code, 0);
  EXPECT_EQ(result.out, "");
  EXPECT_EQ(result.err, "");
}

TEST(Verbs, SynthIsTheSameEveryTime) {
  TempFolder temp;
  for (const char* name : {"a", "b"}) {
    ASSERT_EQ(RunRetint({"synth", "--output", (temp / name).string(), "--width", "48", "--height",
                         "36", "--photos", "3", "--quiet"})
                  .code,
              0);
  }
  const auto files = FilesBelow(temp / "a");
  EXPECT_EQ(files, FilesBelow(temp / "b"));
  EXPECT_THAT(files,
              testing::IsSupersetOf({"sparse/0/cameras.bin", "sparse/0/images.bin",
                                     "sparse/0/points3D.bin", "images/000.png", "splat.ply",
                                     "truth/depth/000.png.bin", "truth/objects/000.png.png"}));
  for (const std::string& name : files) {
    if (fs::is_directory(temp / "a" / name)) continue;
    EXPECT_TRUE(ReadFile(temp / "a" / name) == ReadFile(temp / "b" / name)) << name;
  }
}

}  // namespace
}  // namespace retint
