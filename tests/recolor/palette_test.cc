// SPDX-License-Identifier: BSD-3-Clause
#include "recolor/palette.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "base/error.h"
#include "kernels/common/color_ops.h"
#include "recolor/color_edit.h"

namespace retint {
namespace {

using Eigen::Vector3f;

const Vector3f kYellow(0.9f, 0.75f, 0.1f), kBlue(0.1f, 0.2f, 0.8f), kGreen(0.2f, 0.6f, 0.25f);

// `count` pixels about a color.
void Add(std::vector<float>& pixels, const Vector3f& color, int count, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<float> noise(0, 0.015f);
  for (int i = 0; i < 3 * count; ++i) pixels.push_back(color[i % 3] + noise(random));
}

std::vector<float> ThreeColors() {
  std::vector<float> pixels;
  Add(pixels, kGreen, 200, 1);
  Add(pixels, kYellow, 600, 2);
  Add(pixels, kBlue, 300, 3);
  return pixels;
}

void ExpectColor(const Vector3f& color, const Vector3f& expected, float tolerance) {
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(color[c], expected[c], tolerance) << color.transpose();
}

TEST(PaletteTest, FindsTheColorsInTheOrderOfTheirShares) {
  const auto palette = FindPalette(ThreeColors(), 3);
  ASSERT_EQ(palette.size(), 3u);
  const Vector3f expected[] = {kYellow, kBlue, kGreen};
  const float shares[] = {6 / 11.0f, 3 / 11.0f, 2 / 11.0f};
  for (size_t i = 0; i < 3; ++i) {
    // The median of 200 draws of deviation 0.015 is good to 0.0013; three of these and the pixels'
    // clipping fit in.
    ExpectColor(Vector3f(palette[i].rgb.data()), expected[i], 0.006f);
    EXPECT_NEAR(palette[i].share, shares[i], 1e-6f);
  }
}

TEST(PaletteTest, BlendsAtEdgesDoNotMoveAColor) {
  std::vector<float> pixels;
  Add(pixels, kYellow, 500, 4);
  Add(pixels, kBlue, 500, 5);
  for (int i = 0; i < 100; ++i) {
    const float t = (float(i) + 0.5f) / 100;
    const Vector3f blend = t * kYellow + (1 - t) * kBlue;
    pixels.insert(pixels.end(), blend.data(), blend.data() + 3);
  }
  for (const auto& color : FindPalette(pixels, 2)) {
    const Vector3f found(color.rgb.data());
    const Vector3f& nearest = (found - kYellow).norm() < (found - kBlue).norm() ? kYellow : kBlue;
    // 50 of 550 lie to one side of the color, so the median is the 0.545-quantile of its noise:
    // 0.11 deviations.
    ExpectColor(found, nearest, 0.01f);
  }
}

TEST(PaletteTest, IsTheSameForTheSameSeed) {
  EXPECT_EQ(FindPalette(ThreeColors(), 5, 7), FindPalette(ThreeColors(), 5, 7));
}

TEST(PaletteTest, FindsNoMoreColorsThanThereAre) {
  std::vector<float> pixels(300, 0.25f);
  const auto gray = FindPalette(pixels, 8);
  ASSERT_EQ(gray.size(), 1u);
  ExpectColor(Vector3f(gray[0].rgb.data()), Vector3f::Constant(0.25f), 1e-5f);
  EXPECT_EQ(gray[0].share, 1);
  EXPECT_TRUE(FindPalette({}, 3).empty());
  EXPECT_THROW(FindPalette(pixels, 0), OptionError);
  EXPECT_THROW(FindPalette(pixels, kMaxPaletteColors + 1), OptionError);
}

ColorOperation Palette(std::initializer_list<std::pair<Vector3f, Vector3f>> pairs) {
  ColorOperation op = ColorOperation::Palette(0);
  for (const auto& [from, to] : pairs) {
    op.values.insert(op.values.end(), from.data(), from.data() + 3);
    op.values.insert(op.values.end(), to.data(), to.data() + 3);
  }
  return op;
}

const Vector3f kStays = Vector3f::Constant(kUnset);

TEST(PaletteEditTest, MovesTheColorsAndKeepsTheOthers) {
  const Vector3f red(0.8f, 0.1f, 0.1f);
  const CompiledEdit edit({{Palette({{kYellow, red}, {kBlue, kStays}, {kGreen, kStays}})}, 1});
  // At a main color the others weigh some 1e-8; what remains is float's rounding through OKLab.
  ExpectColor(edit.Apply(kYellow), red, 1e-4f);
  ExpectColor(edit.Apply(kBlue), kBlue, 1e-4f);
  ExpectColor(edit.Apply(kGreen), kGreen, 1e-4f);
  // Near one color, that color decides.
  const Vector3f pale = 0.9f * kBlue + 0.1f * Vector3f::Ones();
  ExpectColor(edit.Apply(pale), pale, 0.03f);
}

TEST(PaletteEditTest, NothingChangesWhereAllStay) {
  const CompiledEdit edit({{Palette({{kYellow, kStays}, {kBlue, kStays}})}, 1});
  const Vector3f color(0.3f, 0.5f, 0.7f);
  ExpectColor(edit.Apply(color), color, 1e-5f);  // float's rounding through OKLab
}

// A surface in less light keeps hue and saturation: the ratio of OKLab's a and b to lightness.
TEST(PaletteEditTest, ShadingKeepsHueAndSaturation) {
  const CompiledEdit edit({{Palette({{kYellow, kBlue}})}, 1});
  const OkLab blue = OkLabFromSrgb(kBlue.data());
  for (const float light : {0.1f, 0.4f, 0.8f}) {
    Vector3f shaded;
    for (int c = 0; c < 3; ++c) shaded[c] = SrgbFromLinear(light * LinearFromSrgb(kYellow[c]));
    const Vector3f moved = edit.Apply(shaded);
    const OkLab lab = OkLabFromSrgb(moved.data());
    EXPECT_NEAR(lab.lightness / blue.lightness, std::cbrt(light), 1e-3f);
    EXPECT_NEAR(lab.a / lab.lightness, blue.a / blue.lightness, 2e-3f);
    EXPECT_NEAR(lab.b / lab.lightness, blue.b / blue.lightness, 2e-3f);
  }
}

// No color jumps: along a line between two colors neighbors stay neighbors.
TEST(PaletteEditTest, IsSmooth) {
  const CompiledEdit edit({{Palette({{kYellow, kBlue}, {kGreen, kStays}})}, 1});
  constexpr int kSteps = 1000;
  Vector3f last = edit.Apply(kYellow);
  for (int i = 1; i <= kSteps; ++i) {
    const float t = float(i) / kSteps;
    const Vector3f here = edit.Apply((1 - t) * kYellow + t * kGreen);
    // The whole way is about 1 long; an inverse fourth power turns within a quarter of it, at most
    // four times as steep as it would evenly.
    EXPECT_LT((here - last).norm(), 0.01f) << t;
    last = here;
  }
}

TEST(PaletteEditTest, RefusesWhatIsNoPalette) {
  EXPECT_THROW(ColorOperation::Palette(0).Check(), OptionError);
  EXPECT_THROW(ColorOperation::Palette(17).Check(), OptionError);
  EXPECT_NO_THROW(ColorOperation::Palette(3).Check());
  ColorOperation half = Palette({{kYellow, kBlue}, {kStays, kBlue}});
  EXPECT_THROW(half.Check(), OptionError);
  ColorOperation bad = Palette({{kYellow, Vector3f(0, std::nanf(""), 0)}});
  EXPECT_THROW(bad.Check(), OptionError);
  EXPECT_TRUE(ColorOperation::Palette(2).NeedsMeasuring());
  EXPECT_FALSE(Palette({{kYellow, kBlue}}).NeedsMeasuring());
  EXPECT_THROW(CompiledEdit({{ColorOperation::Palette(2)}, 1}), OptionError);
}

}  // namespace
}  // namespace retint
