// SPDX-License-Identifier: BSD-3-Clause
// Scenes that are hard on everything: a result, or one sentence that says why there is none.
#include <cmath>
#include <limits>

#include "base/files.h"
#include "colmap_io/sparse.h"
#include "splat_io/splat_io.h"
#include "tests/e2e/bad_input.h"

namespace retint {
namespace {

// Adds `count` Gaussians and hands each of them to `set`.
template <typename Set>
void Add(GaussianModel& model, size_t count, const Set& set) {
  const size_t first = model.NumGaussians();
  const size_t width = static_cast<size_t>(model.NumShCoeffs()) * 3;
  model.source = {};
  model.Resize(first + count, model.sh_degree);
  for (size_t g = first; g < first + count; ++g) {
    model.quats_wxyz[4 * g] = 1;
    std::fill_n(&model.log_scales[3 * g], 3, -4.0F);
    std::fill_n(&model.sh[width * g], 3, 0.5F);
    set(model, g, g - first);
  }
}

// A quick recolor of the spoilt copy.
CommandResult RunRecolor(const Place& place) {
  Arguments arguments = With(place, "recolor",
                             {"--view", TinyView(), "--mask", MaskOf(place).string(), "--tint",
                              "#3060ff", "--depth-method", "gaussian", "--set", "iterations=2",
                              "--output", place.Out("out.ply"), "--progress", "none"});
  return RunRetint(arguments);
}

// Every Gaussian is still there, every value a number, and something changed.
void ExpectResult(const CommandResult& result, const Place& place) {
  ASSERT_EQ(result.code, 0) << result.err;
  const GaussianModel before = ReadSplat(place.in / "splat.ply");
  const GaussianModel after = ReadSplat(place.out / "out.ply");
  EXPECT_EQ(after.means, before.means);
  EXPECT_NE(after.sh, before.sh);
}

void ExpectSentence(const CommandResult& result) {
  EXPECT_EQ(result.code, 3) << result.err;
  EXPECT_EQ(CountLines(result.err), 1) << result.err;
  EXPECT_EQ(result.err.rfind("retint: ", 0), 0u) << result.err;
}

struct Hostile {
  const char* name;
  void (*spoil)(GaussianModel& model);
};

const Hostile kHostile[] = {
    {"Extents",
     [](GaussianModel& model) {
       Add(model, 6, [](GaussianModel& m, size_t g, size_t i) {
         m.means[3 * g + i / 2] = i % 2 == 0 ? 1e7F : -1e7F;
         m.opacity_logits[g] = 2;
       });
     }},
    {"Scales",
     [](GaussianModel& model) {
       Add(model, 8, [](GaussianModel& m, size_t g, size_t i) {
         m.means[3 * g + 2] = 2;
         for (size_t k = 0; k < 3; ++k) {
           m.log_scales[3 * g + k] = std::log(i >> k & 1 ? 1e-9F : 1e6F);
         }
         m.opacity_logits[g] = -3;
       });
     }},
    {"Opacities",
     [](GaussianModel& model) {
       Add(model, 4, [](GaussianModel& m, size_t g, size_t i) {
         m.means[3 * g + 1] = 50;  // behind the selection
         m.opacity_logits[g] = i % 2 == 0 ? 1e4F : -1e4F;
       });
       for (size_t g = 0; g < model.NumGaussians(); g += 3) {
         model.opacity_logits[g] = model.opacity_logits[g] > 0 ? 200.0F : model.opacity_logits[g];
       }
     }},
    {"RotationsOfLengthZeroAndHuge",
     [](GaussianModel& model) {
       for (size_t g = 0; g < model.NumGaussians(); g += 5) {
         for (size_t i = 0; i < 4; ++i) model.quats_wxyz[4 * g + i] *= g % 2 == 0 ? 1e15F : 0;
       }
     }},
    {"ManyInOnePixel",
     [](GaussianModel& model) {
       Add(model, 100000, [](GaussianModel& m, size_t g, size_t) {
         std::copy_n(m.means.data(), 3, &m.means[3 * g]);
         std::fill_n(&m.log_scales[3 * g], 3, -9.0F);
         m.opacity_logits[g] = -4;
       });
     }},
    {"ColorsBeyondEverything",
     [](GaussianModel& model) {
       for (size_t i = 0; i < model.sh.size(); i += 7) model.sh[i] = i % 2 == 0 ? 1e6F : -1e6F;
     }},
};

class HostileScene : public testing::TestWithParam<Hostile> {};

TEST_P(HostileScene, IsRecolored) {
  Place place;
  GaussianModel model = ReadSplat(place.in / "splat.ply");
  GetParam().spoil(model);
  WriteSplat(place.in / "splat.ply", model);
  ExpectResult(RunRecolor(place), place);
}

INSTANTIATE_TEST_SUITE_P(Scenes, HostileScene, testing::ValuesIn(kHostile),
                         [](const auto& one) { return std::string(one.param.name); });

TEST(HostileSplat, OfOneGaussianGetsAResultOrASentence) {
  Place place;
  GaussianModel model = ReadSplat(place.in / "splat.ply");
  model.source = {};
  model.Resize(1, model.sh_degree);
  WriteSplat(place.in / "splat.ply", model);
  const CommandResult result = RunRecolor(place);
  if (result.code == 0) {
    EXPECT_EQ(ReadSplat(place.out / "out.ply").NumGaussians(), 1u);
  } else {
    ExpectSentence(result);
  }
  // Alone it has views placed around it.
  const CommandResult alone = RunRetint({"render", place.In("splat.ply"), "--views", "4", "--all",
                                         "--output", place.Out("r"), "--progress", "none"});
  if (alone.code != 0) ExpectSentence(alone);
}

TEST(HostileSplat, WithoutSparsePointsIsRecolored) {
  Place place;
  fs::remove(place.in / "sparse/0/points3D.bin");
  const CommandResult result = RunRecolor(place);
  ExpectResult(result, place);
  EXPECT_THAT(result.err, testing::HasSubstr("points3D"));
}

TEST(HostileSplat, OfTwoViewsIsRecolored) {
  Place place;
  Reconstruction model = ReadReconstruction(place.in / "sparse/0");
  const ViewId painted = model.FindView(TinyView())->id;
  std::erase_if(model.views, [&](const auto& entry) {
    return entry.first != painted && entry.first != painted + 1 && entry.first + 1 != painted;
  });
  if (model.views.size() > 2) {
    model.views.erase(model.views.begin()->first == painted ? std::prev(model.views.end())
                                                            : model.views.begin());
  }
  ASSERT_EQ(model.views.size(), 2u);
  for (auto& [id, point] : model.points) {
    std::erase_if(point.track, [&](const TrackElement& element) {
      return model.views.count(element.view_id) == 0;
    });
  }
  std::erase_if(model.points, [](const auto& entry) { return entry.second.track.empty(); });
  WriteReconstructionBinary(place.in / "sparse/0", model);
  ExpectResult(RunRecolor(place), place);
}

// Rejected with advice; following it works, and the output says how many were dropped.
TEST(HostileSplat, RowsThatAreNoNumbersAreDroppedOnRequest) {
  Place place;
  GaussianModel model = ReadSplat(place.in / "splat.ply");
  const size_t count = model.NumGaussians();
  SpoilGaussian(place.in / "splat.ply", "y", std::numeric_limits<float>::quiet_NaN());
  CommandResult result =
      RunRetint({"convert", place.In("splat.ply"), place.Out("good.ply"), "--progress", "none"});
  ExpectSentence(result);
  EXPECT_THAT(result.err,
              testing::HasSubstr("Gaussian 0: y is NaN; `retint convert` with --drop-bad"));
  result = RunRetint({"convert", place.In("splat.ply"), place.Out("good.ply"), "--drop-bad",
                      "--progress", "none"});
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(result.out, testing::HasSubstr("1 Gaussians with a value that is NaN or infinite"));
  const GaussianModel after = ReadSplat(place.out / "good.ply");
  ASSERT_EQ(after.NumGaussians(), count - 1);
  EXPECT_TRUE(std::equal(after.means.begin(), after.means.end(), model.means.begin() + 3));
  EXPECT_EQ(after.source.property_order, model.source.property_order);
}

// Strangers name the files: control characters must not reach a terminal.
TEST(HostileNames, AreShownWithoutTheirControlCharacters) {
  Place place;
  Reconstruction model = ReadReconstruction(place.in / "sparse/0");
  for (auto& [id, view] : model.views) {
    if (view.name != TinyView()) view.name = "a\x1b[31m\nb\r\xC2\x9B\xFF" + view.name;
  }
  WriteReconstructionBinary(place.in / "sparse/0", model);
  const auto expect_plain = [](const std::string& text) {
    EXPECT_EQ(text.find_first_of("\x1b\r\xFF"), std::string::npos) << text;
    EXPECT_EQ(text.find("\xC2\x9B"), std::string::npos) << text;
  };
  const CommandResult refused =
      RunRetint(With(place, "render",
                     {"--view", "a", "--output", place.Out("r"), "--progress", "none", "--quiet"}));
  ExpectSentence(refused);
  expect_plain(refused.err);
  EXPECT_THAT(refused.err, testing::HasSubstr("a<U+001B>[31m<U+000A>b<U+000D><U+009B><0xFF>00"));
  const CommandResult listed = RunRetint(With(
      place, "suggest", {"--view", TinyView(), "--mask", MaskOf(place).string(), "--count", "3"}));
  EXPECT_EQ(listed.code, 0) << listed.err;
  expect_plain(listed.err);
  expect_plain(listed.out);
  EXPECT_THAT(listed.out, testing::HasSubstr("a<U+001B>[31m"));
  EXPECT_EQ(CountLines(listed.out), 3) << listed.out;
}

TEST(HostileNames, ThatLeaveTheFolderAreRefusedByTheirOwnName) {
  Place place;
  Reconstruction model = ReadReconstruction(place.in / "sparse/0");
  model.views.begin()->second.name = "../../evil/000.png";
  WriteReconstructionBinary(place.in / "sparse/0", model);
  const CommandResult result = RunRetint(
      With(place, "render",
           {"--all", "--output", place.Out("r"), "--progress", "none", "--log-level", "error"}));
  ExpectSentence(result);
  EXPECT_THAT(result.err, testing::HasSubstr("image name \"../../evil/000.png\" leads outside"));
  EXPECT_THAT(result.err, testing::HasSubstr("images.bin"));
  EXPECT_EQ(result.err.find(".tmp"), std::string::npos) << result.err;
}

TEST(HostileSplat, BytesBehindItAreTold) {
  Place place;
  WriteFile(place.in / "splat.ply", ReadFile(place.in / "splat.ply") + "xyz");
  const CommandResult result = RunRetint(
      {"info", place.in.string(), "--splat", place.In("splat.ply"), "--progress", "none"});
  EXPECT_EQ(result.code, 0);
  EXPECT_THAT(result.err, testing::HasSubstr("retint: warning: " + place.In("splat.ply") +
                                             ": 3 bytes after the last of "));
  EXPECT_EQ(CountLines(result.err), 1) << result.err;
}

}  // namespace
}  // namespace retint
