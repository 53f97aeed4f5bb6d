// SPDX-License-Identifier: BSD-3-Clause
#include "recolor/main_color.h"

#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "kernels/common/color_spaces.h"

namespace retint {
namespace {

class Pixels {
 public:
  // `count` pixels of a color, in light from `low` to `high` times its own, in linear light.
  void Add(int count, const float* rgb, float low, float high) {
    std::uniform_real_distribution<float> uniform(low, high);
    for (int i = 0; i < count; ++i) {
      const float light = uniform(rng_);
      for (int c = 0; c < 3; ++c) {
        values.push_back(SrgbFromLinear(light * LinearFromSrgb(rgb[c])));
      }
    }
  }
  std::vector<float> values;

 private:
  std::mt19937 rng_{11};
};

constexpr float kYellow[3] = {0.9f, 0.75f, 0.1f}, kBlue[3] = {0.1f, 0.2f, 0.8f},
                kWhite[3] = {1, 1, 1};

TEST(MainColorTest, IsTheColorOfMostPixels) {
  Pixels pixels;
  pixels.Add(600, kYellow, 0.5f, 1.0f);
  pixels.Add(300, kBlue, 0.5f, 1.0f);
  pixels.Add(100, kWhite, 0.8f, 1.0f);  // gloss
  const auto main = FindMainColor(pixels.values);
  ASSERT_TRUE(main);
  // Yellow in more light than seven tenths of its pixels, 0.85 of the full one. The quantile of 600
  // draws is good to a few hundredths.
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(main->rgb[size_t(c)], SrgbFromLinear(0.85f * LinearFromSrgb(kYellow[c])), 0.02f);
  }
  EXPECT_NEAR(main->brightest, 0.975f / 0.85f, 0.06f);
}

// Half of an apple is in the shade, and beside it lies its shadow on the table.
TEST(MainColorTest, IsThatOfTheLitSide) {
  constexpr float kRed[3] = {0.75f, 0.28f, 0.22f}, kBrown[3] = {0.4f, 0.3f, 0.2f};
  Pixels pixels;
  pixels.Add(500, kRed, 0.05f, 0.15f);
  pixels.Add(500, kRed, 0.7f, 1.0f);
  pixels.Add(200, kBrown, 0.02f, 0.1f);
  const auto main = FindMainColor(pixels.values);
  ASSERT_TRUE(main);
  // Two fifths of the lit pixels are darker: 0.82 of the full light.
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(main->rgb[size_t(c)], SrgbFromLinear(0.82f * LinearFromSrgb(kRed[c])), 0.02f);
  }
}

TEST(MainColorTest, ShadowsDoNotMoveItsHue) {
  Pixels pixels;
  pixels.Add(1000, kYellow, 0.01f, 1.0f);
  const auto main = FindMainColor(pixels.values);
  ASSERT_TRUE(main);
  const OkLab found = OkLabFromSrgb(main->rgb.data()), truth = OkLabFromSrgb(kYellow);
  EXPECT_NEAR(std::atan2(found.b, found.a), std::atan2(truth.b, truth.a), 0.01f);
  EXPECT_NEAR(std::hypot(found.a, found.b) / found.lightness,
              std::hypot(truth.a, truth.b) / truth.lightness, 0.005f);
}

// Painted in the shade, lit in other views: its color is that of the paint, its light that of all.
TEST(MainColorTest, IsAsBrightAsAnyViewShowsIt) {
  Pixels shade, light;
  shade.Add(500, kYellow, 0.2f, 0.3f);
  light.Add(500, kYellow, 0.8f, 1.0f);
  light.Add(500, kWhite, 0.8f, 1.0f);  // gloss, which is no light of the surface
  const auto alone = FindMainColor(shade.values);
  const auto main = FindMainColor(shade.values, light.values);
  ASSERT_TRUE(alone && main);
  EXPECT_EQ(main->rgb, alone->rgb);
  EXPECT_LT(alone->brightest, 1.25f);
  EXPECT_NEAR(main->brightest, 0.99f / 0.27f, 0.15f);
}

TEST(MainColorTest, TakesBlackAndNothing) {
  EXPECT_FALSE(FindMainColor({}));
  const std::vector<float> black(30, 0.0f);
  const auto main = FindMainColor(black);
  ASSERT_TRUE(main);
  for (const float value : main->rgb) EXPECT_NEAR(value, 0, 1e-3f);
  EXPECT_GE(main->brightest, 1);
  EXPECT_TRUE(std::isfinite(main->brightest));
}

}  // namespace
}  // namespace retint
