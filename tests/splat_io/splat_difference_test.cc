// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include <gtest/gtest.h>

#include "splat_io/splat_difference.h"
#include "tests/splat_io/random_scene.h"

namespace retint {
namespace {

TEST(SplatDifferenceTest, EqualScenesDoNotDiffer) {
  const GaussianModel model = RandomScene(10, 3);
  const SplatDifference difference = Compare(model, model);
  EXPECT_EQ(difference.position_max, 0);
  EXPECT_EQ(difference.color_max, 0);
  EXPECT_EQ(difference.opacity_max, 0);
  EXPECT_EQ(difference.scale_ratio_max, 1);
}

TEST(SplatDifferenceTest, MeasuresEachValueInItsUnit) {
  const GaussianModel before = RandomScene(4, 0);
  GaussianModel after = before;
  after.means[3] += 3;
  after.means[4] += 4;
  after.log_scales[7] += std::log(1.5f);
  after.opacity_logits = before.opacity_logits;
  after.opacity_logits[2] = 0;
  after.sh[5] = before.sh[5] + 0.1f / 0.28209479f * (before.sh[5] < 0 ? 1.0f : -1.0f);
  const SplatDifference difference = Compare(before, after);
  // Floats of numbers up to 10.
  EXPECT_NEAR(difference.position_max, 5, 1e-5);
  EXPECT_NEAR(difference.position_rms, 5 / std::sqrt(4), 1e-5);
  EXPECT_NEAR(difference.scale_ratio_max, 1.5, 1e-5);
  EXPECT_NEAR(difference.color_max, 0.1, 1e-6);
  EXPECT_NEAR(difference.color_rms, 0.1 / std::sqrt(4), 1e-6);
  EXPECT_NEAR(difference.opacity_max,
              std::abs(0.5 - 1 / (1 + std::exp(-double(before.opacity_logits[2])))), 1e-6);
}

TEST(SplatDifferenceTest, ColorsAreThoseThatAreShown) {
  GaussianModel before = RandomScene(1, 0), after = before;
  before.sh = {10, 0, 0};  // white is no more than 1
  after.sh = {20, 0, 0};
  EXPECT_EQ(Compare(before, after).color_max, 0);
}

TEST(SplatDifferenceTest, DroppedBandsCount) {
  GaussianModel before = RandomScene(1, 1), after = RandomScene(1, 0);
  after.sh = {0, 0, 0};
  before.sh.assign(12, 0);
  before.sh[6] = 0.5f;  // z, seen along the axis as 0.4886 of it
  EXPECT_NEAR(Compare(before, after).color_max, 0.5 * 0.4886025, 1e-6);
}

TEST(SplatDifferenceTest, FollowsTheOrderOfTheFile) {
  const GaussianModel before = RandomScene(2, 0);
  GaussianModel after;
  after.Resize(2, 0);
  for (size_t i = 0; i < 3; ++i) {
    for (size_t g = 0; g < 2; ++g) {
      after.means[3 * g + i] = before.means[3 * (1 - g) + i];
      after.log_scales[3 * g + i] = before.log_scales[3 * (1 - g) + i];
      after.sh[3 * g + i] = before.sh[3 * (1 - g) + i];
    }
  }
  for (size_t g = 0; g < 2; ++g) after.opacity_logits[g] = before.opacity_logits[1 - g];
  EXPECT_EQ(Compare(before, after, std::vector<uint32_t>{1, 0}).position_max, 0);
  EXPECT_GT(Compare(before, after).position_max, 0);
}

}  // namespace
}  // namespace retint
