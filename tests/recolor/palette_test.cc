// SPDX-License-Identifier: BSD-3-Clause
#include "recolor/palette.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

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

// A surface of `color` in 0.1 to 1 times the light, with a little noise.
void AddShaded(std::vector<float>& pixels, const Vector3f& color, int count) {
  std::mt19937 random(11);
  std::uniform_real_distribution<float> noise(-0.01f, 0.01f);
  for (int i = 0; i < count; ++i) {
    const float light = 0.1f + 0.9f * float(i) / float(count);
    for (int c = 0; c < 3; ++c) {
      const float shaded = SrgbFromLinear(light * LinearFromSrgb(color[c]));
      pixels.push_back(std::clamp(shaded + noise(random), 0.0f, 1.0f));
    }
  }
}

TEST(PaletteTest, ShadesOfASurfaceAreOneColor) {
  std::vector<float> pixels;
  AddShaded(pixels, kYellow, 2000);
  EXPECT_EQ(FindPalette(pixels, 4).size(), 1u);
  AddShaded(pixels, kBlue, 1000);
  const auto palette = FindPalette(pixels, 6);
  ASSERT_EQ(palette.size(), 2u);
  EXPECT_NEAR(palette[0].share, 2 / 3.0f, 0.02f);  // near black the two are alike
}

// Fur that goes from orange to white without a gap; most of it is one or the other.
TEST(PaletteTest, BlendsDoNotMakeTwoColorsOne) {
  const Vector3f orange(0.62f, 0.38f, 0.14f), white(0.86f, 0.85f, 0.80f);
  std::vector<float> pixels;
  constexpr int kSteps = 2000;
  for (int i = 0; i < kSteps; ++i) {
    const float t = 0.5f - 0.5f * std::cos(float(M_PI) * float(i) / kSteps);
    const Vector3f blend = (1 - t) * orange + t * white;
    pixels.insert(pixels.end(), blend.data(), blend.data() + 3);
  }
  const auto palette = FindPalette(pixels, 5);
  ASSERT_EQ(palette.size(), 2u);
  for (const PaletteColor& color : palette) {
    const Vector3f found(color.rgb.data());
    const float t = (found - orange).dot(white - orange) / (white - orange).squaredNorm();
    // The median of half of them is 0.15 from its end; the halves part anywhere near the middle.
    EXPECT_TRUE(t < 0.35f || t > 0.65f) << t;
    EXPECT_NEAR(color.share, 0.5f, 0.2f);
  }
}

// It is as far from the ball's color as that white from the orange, but little of the ball.
TEST(PaletteTest, AHighlightIsNoMainColor) {
  const Vector3f orange(0.82f, 0.37f, 0.18f), light(0.95f, 0.8f, 0.7f);
  std::vector<float> pixels;
  AddShaded(pixels, orange, 2000);
  for (int i = 0; i < 200; ++i) {
    const Vector3f blend = orange + float(i) / 200 * (light - orange);
    pixels.insert(pixels.end(), blend.data(), blend.data() + 3);
  }
  EXPECT_EQ(FindPalette(pixels, 5).size(), 1u);
}

TEST(PaletteTest, RareColorsAreNoMainColors) {
  std::vector<float> pixels;
  Add(pixels, kYellow, 1000, 8);
  Add(pixels, kBlue, 5, 9);
  EXPECT_EQ(FindPalette(pixels, 3).size(), 1u);
  Add(pixels, kBlue, 45, 10);  // a small label
  EXPECT_EQ(FindPalette(pixels, 3).size(), 2u);
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
  // At a main color, the others weigh about 1e-7. The rest is float rounding through OKLab.
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

// Black has no light to take more of: grays stay in their order, below white, and no brighter than
// the way from the new color to white has them.
TEST(PaletteEditTest, BlackThatGetsLightLeavesOtherColorsTheirs) {
  const Vector3f black = Vector3f::Zero(), blue(0.19f, 0.38f, 1), tan(0.78f, 0.7f, 0.47f);
  for (const auto& palette : {Palette({{black, blue}}), Palette({{black, blue}, {tan, kStays}})}) {
    const CompiledEdit edit({{palette}, 1});
    ExpectColor(edit.Apply(black), blue, 1e-4f);
    float last = 0;
    for (float gray = 0; gray < 0.96f; gray += 0.05f) {
      const Vector3f moved = edit.Apply(Vector3f::Constant(gray));
      const float lightness = OkLabFromSrgb(moved.data()).lightness;
      const Vector3f before = Vector3f::Constant(gray);
      const float was = OkLabFromSrgb(before.data()).lightness;
      const float to = OkLabFromSrgb(blue.data()).lightness;
      EXPECT_LT(lightness, to + (1 - to) * was + 0.02f) << gray;
      if (palette.values.size() == kPairValues) {
        EXPECT_GT(lightness, last) << gray;
      }
      last = lightness;
    }
  }
  // Half the light of a dark gray stays half the light of its new color: black stays black.
  const Vector3f dark = Vector3f::Constant(0.2f);
  const CompiledEdit edit({{Palette({{dark, Vector3f::Constant(0.45f)}})}, 1});
  EXPECT_NEAR(
      edit.Apply(Vector3f::Constant(0.1f))[0] / edit.Apply(dark)[0],
      SrgbFromLinear(LinearFromSrgb(0.45f) * LinearFromSrgb(0.1f) / LinearFromSrgb(0.2f)) / 0.45f,
      1e-3f);
}

// No color jumps: along a line between two colors neighbors stay neighbors.
TEST(PaletteEditTest, IsSmooth) {
  const CompiledEdit edit({{Palette({{kYellow, kBlue}, {kGreen, kStays}})}, 1});
  constexpr int kSteps = 1000;
  Vector3f last = edit.Apply(kYellow);
  for (int i = 1; i <= kSteps; ++i) {
    const float t = float(i) / kSteps;
    const Vector3f here = edit.Apply((1 - t) * kYellow + t * kGreen);
    // The whole way is about 1 long; an inverse third power turns within a third of it, at most
    // three times as steep as it would evenly.
    EXPECT_LT((here - last).norm(), 0.01f) << t;
    last = here;
  }
}

// By how much a palette magnifies small differences of the pixels' colors, in OKLab: nine in ten
// pixels are below.
float Magnifies(const ColorOperation& palette, const std::vector<float>& pixels) {
  const CompiledEdit edit({{palette}, 1});
  std::mt19937 random(12);
  std::uniform_real_distribution<float> noise(-0.01f, 0.01f);
  const auto distance = [](const Vector3f& x, const Vector3f& y) {
    const OkLab a = OkLabFromSrgb(x.data()), b = OkLabFromSrgb(y.data());
    return std::hypot(a.lightness - b.lightness, a.a - b.a, a.b - b.b);
  };
  std::vector<float> factors;
  for (size_t i = 0; i < pixels.size(); i += 3) {
    const Vector3f color(&pixels[i]);
    Vector3f near = color;
    for (int c = 0; c < 3; ++c) near[c] = std::max(near[c] + noise(random), 0.0f);
    factors.push_back(distance(edit.Apply(near), edit.Apply(color)) / distance(near, color));
  }
  const auto at = factors.begin() + ptrdiff_t(factors.size() * 9 / 10);
  std::nth_element(factors.begin(), at, factors.end());
  return *at;
}

// A fit can follow this: almost equal colors stay alike after an edit of a measured palette.
TEST(PaletteEditTest, AMeasuredPaletteMagnifiesNoSmallDifference) {
  const Vector3f tan(0.74f, 0.62f, 0.42f), blue(0.19f, 0.38f, 1);
  std::vector<float> pixels;  // fur, and the paint on it
  AddShaded(pixels, tan, 1500);
  AddShaded(pixels, {0.80f, 0.76f, 0.66f}, 700);
  AddShaded(pixels, {0.61f, 0.42f, 0.24f}, 500);
  AddShaded(pixels, kGreen, 500);
  ColorOperation measured = ColorOperation::Palette(0);
  for (const auto& color : FindPalette(pixels, 4)) {
    const Vector3f to = measured.values.empty() ? blue : kStays;
    measured.values.insert(measured.values.end(), color.rgb.begin(), color.rgb.end());
    measured.values.insert(measured.values.end(), to.data(), to.data() + 3);
  }
  EXPECT_EQ(measured.values.size(), 2 * kPairValues);
  const float factor = Magnifies(measured, pixels);
  EXPECT_LT(factor, 1.8f);
  // If shades of the fur are palette colors, small differences grow more.
  const auto split =
      Palette({{tan, blue}, {{0.80f, 0.76f, 0.66f}, kStays}, {{0.61f, 0.42f, 0.24f}, kStays}});
  EXPECT_GT(Magnifies(split, pixels), 1.3f * factor) << factor;
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
