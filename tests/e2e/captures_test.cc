// SPDX-License-Identifier: BSD-3-Clause
// One painted mask on real captures, through the real program with its default pipeline: the masks
// of the other views against the truth.
#include <algorithm>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "base/files.h"
#include "colmap_io/image_io.h"
#include "tests/e2e/command.h"
#include "tests/support/data.h"
#include "tests/support/iou.h"

namespace retint {
namespace {

// Recolors the paint on one view, from <capture>/<masks>. The masks of all views go to
// `temp`/stages/ masks. One sweep of the fit is enough, because the masks come first.
void Recolor(const std::string& capture, const std::string& masks, const std::string& view,
             const TempFolder& temp) {
  const std::string folder = DataPath(capture).string();
  const CommandResult result =
      RunRetint({"recolor", folder, "--splat", folder + "/splat.ply", "--view", view, "--mask",
                 ViewFile(folder + "/" + masks, view).string(), "--tint", "0.2,0.4,1", "--set",
                 "iterations=1", "--output", (temp / "out.ply").string(), "--save-stages",
                 (temp / "stages").string(), "--quiet"});
  ASSERT_EQ(result.code, 0) << result.err;
}

Mask MaskOf(const TempFolder& temp, const std::string& view) {
  return ReadMask(ViewFile(temp / "stages/masks", view));
}

// Of the masks of all views but the painted one against the truth.
struct Score {
  int views = 0;
  double mean = 0, worst = 1;
};

Score CompareWithTruth(const std::string& truth, const std::string& painted,
                       const TempFolder& temp) {
  Score score;
  for (const auto& file : std::filesystem::directory_iterator(DataPath(truth))) {
    const std::string view = file.path().stem().string();
    if (view == painted) continue;
    const double iou = IouOf(MaskOf(temp, view), ReadMask(file.path()));
    score.mean += iou;
    score.worst = std::min(score.worst, iou);
    ++score.views;
  }
  score.mean /= std::max(1, score.views);
  return score;
}

TEST(Captures, OnePaintedMaskOfTheFlowerSelectsItInEveryView) {
  RETINT_REQUIRE_DATA("flower/truth");
  TempFolder temp;
  ASSERT_NO_FATAL_FAILURE(Recolor("flower", "masks", "012.jpg", temp));
  const Score score = CompareWithTruth("flower/truth", "012.jpg", temp);
  ASSERT_EQ(score.views, 24);
  EXPECT_GT(score.mean, 0.91);
  EXPECT_GT(score.worst, 0.85);
}

// The cameras go all around the cape, so that one view sees less than half of it.
TEST(Captures, OnePaintedMaskOfTheCapeSelectsAllOfItsSides) {
  RETINT_REQUIRE_DATA("cape/truth");
  TempFolder temp;
  ASSERT_NO_FATAL_FAILURE(Recolor("cape", "truth", "IMG_5881.jpg", temp));
  const Score score = CompareWithTruth("cape/truth", "IMG_5881.jpg", temp);
  ASSERT_EQ(score.views, 59);
  // Measured: 0.98 and 0.87; 0.47 and 0.01 without completion.
  EXPECT_GT(score.mean, 0.95);
  EXPECT_GT(score.worst, 0.75);
}

TEST(Captures, OnePaintedMaskOfTheFoxStaysOnTheFox) {
  RETINT_REQUIRE_DATA("fox/truth");
  TempFolder temp;
  ASSERT_NO_FATAL_FAILURE(Recolor("fox", "masks", "0025.jpg", temp));
  const MaskScore painted =
      ScoreMask(MaskOf(temp, "0025.jpg"), ReadMask(DataPath("fox/masks/0025.jpg.png")));
  // Measured: 0.94. The hand that painted it stopped short of the ears' and the snout's edges.
  EXPECT_GT(painted.iou, 0.92);
  const MaskScore other =
      ScoreMask(MaskOf(temp, "0001.jpg"), ReadMask(DataPath("fox/truth/0001.jpg.png")));
  EXPECT_GT(other.precision, 0.95);
  // 0025 does not show the other cheek: measured 0.83, and 0.49 without completion.
  EXPECT_GT(other.iou, 0.7);
}

}  // namespace
}  // namespace retint
