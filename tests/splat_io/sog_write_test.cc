// SPDX-License-Identifier: BSD-3-Clause
// SOG scenes that Retint writes: bundles and folders, tables, and unchanged parts of a scene that
// came from one.
#include <algorithm>
#include <set>

#include <gmock/gmock.h>

#include "splat_io/sog_codec.h"
#include "splat_io/sog_files.h"
#include "splat_io/sog_tables.h"
#include "tests/splat_io/ply_text.h"
#include "tests/splat_io/random_scene.h"

namespace retint {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::vector<uint32_t> OrderOf(const GaussianModel& model) { return SogCodec().WriteOrder(model); }

// Positions: half a step of 65535 of ln(1 + 5) on either side, times 1 + 5. Rotations: half a step
// of 255 of the square root of 2, and its effect on the fourth component. Opacities: half a step of
// 255. Tables: 256 entries for the even values of 300 Gaussians, so half a step of 9 / 256 and 3.4
// / 256. Not quite even entries may have twice that. Higher bands have a set for each Gaussian:
// half a step of 1 / 256, twice that too.
constexpr Rounding kRounding = {.mean = 1.7e-4,
                                .log_scale = 0.036,
                                .opacity = 1 / 510.0 + 1e-6,
                                .color = 0.0038,
                                .sh = 0.004,
                                .rotation = 0.012};

TEST(SogWriting, RoundTripsWithinItsRoundingInEveryDegree) {
  TempFolder folder;
  for (int degree = 0; degree <= 3; ++degree) {
    SCOPED_TRACE(degree);
    const GaussianModel before = RandomScene(300, degree);
    WriteSplat(folder / "a.sog", before);
    const GaussianModel after = ReadSplat(folder / "a.sog");
    EXPECT_EQ(after.sh_degree, degree);
    ExpectNear(before, after, kRounding, OrderOf(before));
  }
}

TEST(SogWriting, FoldersHoldWhatBundlesHold) {
  TempFolder folder;
  const GaussianModel before = RandomScene(70, 2);
  WriteSplat(folder / "a.sog", before);
  WriteSplat(folder / "scene" / "meta.json", before);
  const GaussianModel bundle = ReadSplat(folder / "a.sog");
  const GaussianModel loose = ReadSplat(folder / "scene" / "meta.json");
  EXPECT_EQ(bundle.means, loose.means);
  EXPECT_EQ(bundle.sh, loose.sh);
  std::set<std::string> names;
  uint64_t bytes = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder / "scene")) {
    names.insert(entry.path().filename().string());
    bytes += entry.file_size();
  }
  EXPECT_EQ(SplatBytes(folder / "scene" / "meta.json"), bytes);
  EXPECT_EQ(SplatBytes(folder / "a.sog"), std::filesystem::file_size(folder / "a.sog"));
  // Other files there do not belong to the splat.
  SpillFile(folder / "scene" / "other.webp", "another picture");
  EXPECT_EQ(SplatBytes(folder / "scene" / "meta.json"), bytes);
  EXPECT_THAT(names,
              ElementsAre("means_l.webp", "means_u.webp", "meta.json", "quats.webp", "scales.webp",
                          "sh0.webp", "shN_centroids.webp", "shN_labels.webp"));
  EXPECT_THAT(MessageOf<OptionError>([&] { WriteSplat(folder / "other.json", before); }),
              HasSubstr("cannot write"));
}

TEST(SogWriting, TheSameSceneGivesTheSameBytes) {
  TempFolder folder;
  const GaussianModel scene = RandomScene(500, 3);
  WriteSplat(folder / "a.sog", scene);
  WriteSplat(folder / "b.sog", scene);
  EXPECT_EQ(ReadFile(folder / "a.sog"), ReadFile(folder / "b.sog"));
}

// Everything of a scene that came from a SOG is a table's entry already.
TEST(SogWriting, AReadSceneIsWrittenWithTheSameValues) {
  TempFolder folder;
  WriteSplat(folder / "a.sog", RandomScene(400, 3));
  const GaussianModel once = ReadSplat(folder / "a.sog");
  WriteSplat(folder / "b.sog", once);
  const GaussianModel twice = ReadSplat(folder / "b.sog");
  EXPECT_EQ(twice.sh, once.sh);
  EXPECT_EQ(twice.log_scales, once.log_scales);
  EXPECT_EQ(twice.opacity_logits, once.opacity_logits);
  EXPECT_EQ(twice.means, once.means);
  EXPECT_EQ(twice.quats_wxyz, once.quats_wxyz);
}

TEST(SogWriting, AnotherProgramsBundleKeepsItsValues) {
  RETINT_REQUIRE_DATA("splats/angel.sog");
  TempFolder folder;
  const GaussianModel before = ReadSplat(DataPath("splats/angel.sog"));
  WriteSplat(folder / "angel.sog", before);
  const GaussianModel after = ReadSplat(folder / "angel.sog");
  EXPECT_EQ(after.sh, before.sh);
  EXPECT_EQ(after.log_scales, before.log_scales);
  EXPECT_EQ(after.opacity_logits, before.opacity_logits);
  EXPECT_EQ(after.means, before.means);
  EXPECT_EQ(after.quats_wxyz, before.quats_wxyz);
  EXPECT_EQ(after.NumGaussians(), 71359u);
}

TEST(SogWriting, ARecolorMovesNothingElse) {
  TempFolder folder;
  WriteSplat(folder / "a.sog", RandomScene(2000, 1));
  const GaussianModel before = ReadSplat(folder / "a.sog");
  GaussianModel edited = before;
  const size_t width = 12;
  for (size_t g = 100; g < 140; ++g) {
    for (size_t i = 0; i < width; ++i) edited.sh[g * width + i] *= 0.9f;
  }
  WriteSplat(folder / "b.sog", edited);
  const GaussianModel after = ReadSplat(folder / "b.sog");
  EXPECT_EQ(after.means, before.means);
  EXPECT_EQ(after.log_scales, before.log_scales);
  EXPECT_EQ(after.opacity_logits, before.opacity_logits);
  EXPECT_EQ(after.quats_wxyz, before.quats_wxyz);
  for (size_t g = 0; g < 2000; ++g) {
    SCOPED_TRACE(g);
    const bool is_edited = g >= 100 && g < 140;
    for (size_t i = 0; i < width; ++i) {
      // One step of 255 of the color: tables may round a new color by that much.
      const float most = is_edited ? 1 / 255.0f / 0.28209479f + 1e-6f : 0;
      ASSERT_NEAR(after.sh[g * width + i], edited.sh[g * width + i], most);
    }
  }
}

TEST(SogWriting, ColorsBeyondTheTableMakeItAnew) {
  TempFolder folder;
  WriteSplat(folder / "a.sog", RandomScene(2000, 0));
  GaussianModel edited = ReadSplat(folder / "a.sog");
  for (size_t i = 0; i < 300; ++i) edited.sh[i] = 3 + static_cast<float>(i) * 1e-3f;
  WriteSplat(folder / "b.sog", edited);
  const GaussianModel after = ReadSplat(folder / "b.sog");
  for (size_t i = 0; i < edited.sh.size(); ++i) {
    // 256 entries for 4.7 of values, and twice half a step where they are not even.
    ASSERT_NEAR(after.sh[i], edited.sh[i], 0.03) << i;
  }
}

TEST(SogTables, FewValuesAreKeptAndManyAreNear) {
  EXPECT_THAT(FitTable({3, 1, 2, 1, 3}), ElementsAre(1, 2, 3));
  std::vector<float> even;
  for (int i = 0; i < 10000; ++i) even.push_back(static_cast<float>(i) / 10000);
  const std::vector<float> table = FitTable(even);
  ASSERT_EQ(table.size(), 256u);
  EXPECT_TRUE(std::is_sorted(table.begin(), table.end()));
  const TableLookup lookup(table);
  double squares = 0;
  for (const float value : even) {
    const double off = static_cast<double>(table[lookup.Find(value)] - value);
    squares += off * off;
  }
  // The least there can be is a step of 1 / 256 over the square root of 12; within a tenth of it.
  EXPECT_LT(std::sqrt(squares / 10000), 1.1 / 256 / std::sqrt(12.0));
}

TEST(SogTables, LookupsFindTheNearest) {
  const std::vector<float> table = {5, -1, 2, 2};
  const TableLookup lookup(table);
  EXPECT_EQ(lookup.Find(-9), 1);
  EXPECT_EQ(lookup.Find(0.4f), 1);
  EXPECT_EQ(lookup.Find(0.6f), 2);
  EXPECT_EQ(lookup.Find(3.5f), 2);
  EXPECT_EQ(lookup.Find(100), 0);
}

TEST(SogTables, ARefitKeepsWhatIsUsed) {
  std::vector<float> table;
  for (int i = 0; i < 256; ++i) table.push_back(static_cast<float>(i));
  // 255 is free for a new value, and the others stay.
  std::vector<float> values(table.begin(), table.end() - 1);
  values.push_back(7.25f);
  const std::vector<float> kept = RefitTable(table, values, 0.01f);
  EXPECT_TRUE(std::equal(table.begin(), table.end() - 1, kept.begin()));
  EXPECT_EQ(kept[255], 7.25f);
  // Nothing is free: the nearest will do where it is near enough, else all are made anew.
  values.push_back(255);
  EXPECT_EQ(RefitTable(table, values, 0.3f), table);
  const std::vector<float> anew = RefitTable(table, values, 0.01f);
  EXPECT_NE(anew, table);
  EXPECT_EQ(anew.size(), 256u);
}

TEST(SogTables, PalettesHoldWhatFitsAndSplitTheRest) {
  Monitor monitor;
  std::vector<float> vectors;
  for (int i = 0; i < 100; ++i) {
    const auto x = static_cast<float>(i % 10);
    vectors.insert(vectors.end(), {x, x > 4 ? 50.0f : 0.0f});
  }
  const VectorPalette all = FitPalette(vectors.data(), 100, 2, 2, {}, 16, monitor);
  EXPECT_EQ(all.Count(), 10u);
  for (size_t g = 0; g < 100; ++g) {
    EXPECT_EQ(all.entries[2 * all.labels[g]], vectors[2 * g]);
    EXPECT_EQ(all.entries[2 * all.labels[g] + 1], vectors[2 * g + 1]);
  }
  const VectorPalette two = FitPalette(vectors.data(), 100, 2, 2, {}, 2, monitor);
  EXPECT_THAT(two.entries, ElementsAre(2, 0, 7, 50));
  // Those that are known and used stay in their places.
  const std::vector<float> known = {9, 9, 3, 0};
  const VectorPalette kept = FitPalette(vectors.data(), 100, 2, 2, known, 16, monitor);
  EXPECT_EQ(kept.Count(), 10u);
  EXPECT_EQ(kept.labels[3], 1u);
  EXPECT_EQ(kept.entries[2], 3);
  EXPECT_NE(kept.entries[1], 9);
}

TEST(SogFilesTest, TransparentPixelsKeepTheirColor) {
  RgbaPicture picture{4, 4, {}};
  for (int i = 0; i < 64; ++i) picture.rgba.push_back(static_cast<uint8_t>(i % 4 == 3 ? 0 : i));
  EXPECT_EQ(DecodeWebp(EncodeWebp(picture), 16, 16, "a.webp", "a.webp").rgba, picture.rgba);
}

}  // namespace
}  // namespace retint
