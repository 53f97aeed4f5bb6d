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

namespace retint {
namespace {

struct Overlap {
  double iou = 0, precision = 0;
};

Overlap Compare(const Mask& mask, const Mask& truth) {
  double both = 0, in_mask = 0, in_truth = 0;
  for (size_t i = 0; i < truth.data.size(); ++i) {
    const bool a = mask.data[i] >= 128, b = truth.data[i] >= 128;
    both += a && b;
    in_mask += a;
    in_truth += b;
  }
  return {both / std::max(1.0, in_mask + in_truth - both), both / std::max(1.0, in_mask)};
}

// Recolors what was painted in one view; the masks of every view are in `temp`/stages/masks. One
// sweep of the fit is enough here, since the masks come before it.
void Recolor(const std::string& capture, const std::string& view, const TempFolder& temp) {
  const std::string folder = DataPath(capture).string();
  const CommandResult result =
      RunRetint({"recolor", "--workspace", folder, "--splat", folder + "/splat.ply", "--view", view,
                 "--mask", ViewFile(folder + "/masks", view).string(), "--tint", "0.2,0.4,1",
                 "--iterations", "1", "--output", (temp / "out.ply").string(), "--save-stages",
                 (temp / "stages").string(), "--quiet"});
  ASSERT_EQ(result.code, 0) << result.err;
}

Mask MaskOf(const TempFolder& temp, const std::string& view) {
  return ReadMask(ViewFile(temp / "stages/masks", view));
}

TEST(Captures, OnePaintedMaskOfTheFlowerSelectsItInEveryView) {
  RETINT_REQUIRE_DATA("flower/truth");
  TempFolder temp;
  ASSERT_NO_FATAL_FAILURE(Recolor("flower", "012.jpg", temp));
  double sum = 0, worst = 1;
  int views = 0;
  for (const auto& file : std::filesystem::directory_iterator(DataPath("flower/truth"))) {
    const std::string view = file.path().stem().string();
    if (view == "012.jpg") continue;  // the painted one
    const double iou = Compare(MaskOf(temp, view), ReadMask(file.path())).iou;
    sum += iou;
    worst = std::min(worst, iou);
    ++views;
  }
  ASSERT_EQ(views, 24);
  EXPECT_GT(sum / views, 0.91);
  EXPECT_GT(worst, 0.85);
}

TEST(Captures, OnePaintedMaskOfTheFoxStaysOnTheFox) {
  RETINT_REQUIRE_DATA("fox/truth");
  TempFolder temp;
  ASSERT_NO_FATAL_FAILURE(Recolor("fox", "0025.jpg", temp));
  const Overlap painted =
      Compare(MaskOf(temp, "0025.jpg"), ReadMask(DataPath("fox/masks/0025.jpg.png")));
  EXPECT_GT(painted.iou, 0.95);
  const Overlap other =
      Compare(MaskOf(temp, "0001.jpg"), ReadMask(DataPath("fox/truth/0001.jpg.png")));
  EXPECT_GT(other.precision, 0.95);
  EXPECT_GT(other.iou, 0.35);  // the other cheek cannot be seen from 0025
}

}  // namespace
}  // namespace retint
