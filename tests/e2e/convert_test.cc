// SPDX-License-Identifier: BSD-3-Clause
// retint convert, and recoloring scenes of other formats than .ply.
#include <cstring>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "base/files.h"
#include "splat_io/splat_io.h"
#include "tests/e2e/command.h"
#include "tests/support/data.h"

namespace retint {
namespace {

using json = nlohmann::json;
using testing::HasSubstr;
using testing::IsEmpty;

std::string Splat() { return (TinyWorkspace() / "splat.ply").string(); }

json Convert(const std::string& from, const std::filesystem::path& to,
             const std::filesystem::path& report) {
  const CommandResult result =
      RunRetint({"convert", from, to.string(), "--report", report.string(), "--progress", "none",
                 "--cameras", TinyWorkspace().string()});
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(result.err, "");
  for (const char* part :
       {"Gaussians ", "size ", "position ", "color ", "opacity ", "scale ", "wrote "}) {
    EXPECT_THAT(result.out, HasSubstr(part));
  }
  return result.code == 0 ? json::parse(ReadFile(report)) : json();
}

TEST(Convert, EveryWritableFormatTellsWhatItCosts) {
  const TempFolder temp;
  const GaussianModel model = ReadSplat(Splat());
  ASSERT_EQ(model.sh_degree, 3);
  for (const SplatFormat& format : SplatFormats()) {
    // A streamed SOG is written only from a streamed SOG.
    if (!format.writable || format.name.starts_with("streamed")) continue;
    const auto path = temp / ("out" + std::string(format.extensions[0]));
    SCOPED_TRACE(path);
    const json report = Convert(Splat(), path, temp / "report.json");
    EXPECT_EQ(report["gaussians"], model.NumGaussians());
    EXPECT_EQ(report["input"]["sh_degree"], 3);
    EXPECT_EQ(report["input"]["bytes"], std::filesystem::file_size(Splat()));
    EXPECT_EQ(report["output"]["bytes"], std::filesystem::file_size(path));
    EXPECT_EQ(report["output"]["format"], format.name);
    const GaussianModel back = ReadSplat(path);
    EXPECT_EQ(back.NumGaussians(), model.NumGaussians());
    EXPECT_EQ(report["output"]["sh_degree"], back.sh_degree);
    EXPECT_EQ(report["losses"].empty(), back.sh_degree == 3) << report["losses"];
    const json& difference = report["difference"];
    for (const char* key : {"position_max", "position_rms", "color_max", "color_rms", "opacity_max",
                            "scale_ratio_max"}) {
      EXPECT_TRUE(difference[key].is_number()) << key;
    }
    const bool rounds = CodecForWriting(path).Rounds();
    ASSERT_EQ(report.contains("color_error"), rounds);
    if (rounds) {
      const json& color = report["color_error"];
      EXPECT_EQ(color["views"], 6);
      EXPECT_GT(color["mean"], 0);
      EXPECT_GE(color["worst"], color["mean"]);
      EXPECT_GE(color["percentile_99"], color["mean"]);
      // Hardly to be seen, but where the directional color is dropped.
      EXPECT_LT(color["mean"], back.sh_degree == 3 ? 1.5 : 15);
    }
    // Half a byte's step.
    EXPECT_LE(difference["opacity_max"], 0.5 / 255 + 1e-6);
    if (format.extensions[0] == ".ply") {
      EXPECT_EQ(difference["position_max"], 0);
      EXPECT_EQ(difference["color_max"], 0);
    }
  }
}

TEST(Convert, ASceneGoesThroughEveryFormatAndBack) {
  const TempFolder temp;
  Convert(Splat(), temp / "a.glb", temp / "r.json");
  Convert(temp / "a.glb", temp / "b.spz", temp / "r.json");
  Convert(temp / "b.spz", temp / "c.compressed.ply", temp / "r.json");
  const json last = Convert(temp / "c.compressed.ply", temp / "d.splat", temp / "r.json");
  // .splat has 8 bits of color, but no view-dependence.
  EXPECT_EQ(last["losses"].size(), 1u);
  EXPECT_EQ(last["difference"]["position_max"], 0);
  Convert(temp / "d.splat", temp / "e.ply", temp / "r.json");
  EXPECT_EQ(ReadSplat(temp / "e.ply").NumGaussians(), ReadSplat(Splat()).NumGaussians());
}

TEST(Convert, TheSizeIsThatOfAllFilesOfASplat) {
  const TempFolder temp;
  std::filesystem::create_directory(temp / "sog");
  const json report = Convert(Splat(), temp / "sog" / "meta.json", temp / "r.json");
  uint64_t bytes = 0;
  for (const auto& entry : std::filesystem::directory_iterator(temp / "sog")) {
    bytes += entry.file_size();
  }
  EXPECT_GT(bytes, 2 * std::filesystem::file_size(temp / "sog" / "meta.json"));
  EXPECT_EQ(report["output"]["bytes"], bytes);
  const json back = Convert(temp / "sog" / "meta.json", temp / "back.ply", temp / "r.json");
  EXPECT_EQ(back["input"]["bytes"], bytes);
}

TEST(Convert, PredictsWithoutWriting) {
  const TempFolder temp;
  const CommandResult result =
      RunRetint({"convert", Splat(), (temp / "a.splat").string(), "--predict", "--progress", "none",
                 "--cameras", TinyWorkspace().string()});
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("rounding     .splat: DeltaE00 "));
  EXPECT_THAT(result.out, testing::Not(HasSubstr("wrote")));
  EXPECT_THAT(FilesBelow(temp.path()), testing::IsEmpty());
}

// Two Gaussians, and views that are placed around them.
TEST(Convert, ASplatAloneHasAColorErrorToo) {
  const TempFolder temp;
  GaussianModel model;
  model.Resize(2, 0);
  model.means = {0, 0, 0, 0.5F, 0.2F, 0};
  model.quats_wxyz = {1, 0, 0, 0, 1, 0, 0, 0};
  model.log_scales.assign(6, -1.5F);
  model.opacity_logits = {3, 3};
  model.sh = {1, 0.123F, -1, -0.7F, 0.5F, 0.321F};
  WriteSplat(temp / "in.ply", model);
  const CommandResult result =
      RunRetint({"convert", (temp / "in.ply").string(), (temp / "out.splat").string(), "--report",
                 (temp / "r.json").string(), "--progress", "none"});
  ASSERT_EQ(result.code, 0) << result.err;
  const json color = json::parse(ReadFile(temp / "r.json"))["color_error"];
  EXPECT_EQ(color["views"], 6);
  // Half a step of 255 in a channel is invisible, and so is half a step of opacity.
  EXPECT_LT(color["mean"], 0.5);
}

TEST(Convert, BadArgumentsAreToldInOneLine) {
  const TempFolder temp;
  WriteFile(temp / "bad.spz", "NGSP and no more");
  const auto refused = [&](int code, const std::vector<std::string>& arguments) {
    std::vector<std::string> all = {"convert", "--progress", "none"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    const CommandResult result = RunRetint(all);
    EXPECT_EQ(result.code, code) << result.err;
    EXPECT_EQ(CountLines(result.err), 1) << result.err;
    EXPECT_EQ(result.out, "");
    EXPECT_THAT(FilesBelow(temp.path()), testing::ElementsAre("bad.spz"));
    return result.err;
  };
  EXPECT_THAT(refused(2, {Splat()}), HasSubstr("OUTPUT"));
  EXPECT_THAT(refused(2, {Splat(), temp / "a.ksplat"}), HasSubstr("cannot write .ksplat"));
  EXPECT_THAT(refused(2, {Splat(), temp / "a.xyz"}), HasSubstr("supported: compressed .ply"));
  EXPECT_THAT(refused(3, {temp / "none.ply", temp / "a.spz"}), HasSubstr("none.ply"));
  EXPECT_THAT(refused(3, {temp / "bad.spz", temp / "a.ply"}), HasSubstr("bad.spz"));
}

// A recolored .splat keeps every byte except the changed colors. Other formats are written by their
// extension, with a warning about their losses.
TEST(Convert, RecolorReadsAndWritesOtherFormats) {
  const TempFolder temp;
  Convert(Splat(), temp / "in.splat", temp / "r.json");
  const auto recolor = [&](const std::string& splat, const std::string& output) {
    return RunRetint({"recolor", TinyWorkspace().string(), "--splat", splat, "--view", TinyView(),
                      "--mask", TinyMask().string(), "--tint", "1.5,0.5,0.5", "--set",
                      "iterations=2", "--output", output, "--progress", "none"});
  };
  CommandResult result = recolor(temp / "in.splat", temp / "out.splat");
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(result.err, "");
  const std::string before = ReadFile(temp / "in.splat"), after = ReadFile(temp / "out.splat");
  ASSERT_EQ(after.size(), before.size());
  size_t changed = 0;
  for (size_t at = 0; at < before.size(); at += 32) {
    // Position and scale, opacity and rotation.
    EXPECT_EQ(before.compare(at, 24, after, at, 24), 0);
    EXPECT_EQ(before.compare(at + 27, 5, after, at + 27, 5), 0);
    changed += before.compare(at + 24, 3, after, at + 24, 3) != 0;
  }
  EXPECT_GT(changed, 0u);
  EXPECT_LT(changed, before.size() / 32 / 2);
  EXPECT_THAT(result.out, HasSubstr("rounding     .splat: DeltaE00 "));

  result = recolor(Splat(), temp / "out.spz");
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(ReadSplat(temp / "out.spz").sh_degree, 3);
  result = recolor(Splat(), temp / "out.splat");
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("out.splat: spherical harmonics above degree 0 are dropped"));
  EXPECT_EQ(CountLines(result.err), 1);
}

}  // namespace
}  // namespace retint
