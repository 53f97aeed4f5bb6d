// SPDX-License-Identifier: BSD-3-Clause
#include "recolor/color_edit.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "base/error.h"
#include "kernels/common/color_ops.h"

namespace retint {
namespace {

using Eigen::Vector3f;
using Kind = ColorOperationKind;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

ColorEdit Edit(std::vector<ColorOperation> operations) { return {std::move(operations), 1}; }

ColorEdit Edit(Kind kind, std::initializer_list<float> values = {}) {
  return Edit({ColorOperation::Make(kind, values)});
}

Vector3f Apply(const ColorEdit& edit, const Vector3f& color) {
  return CompiledEdit(edit).Apply(color);
}

OkLab Lab(const Vector3f& color) { return OkLabFromSrgb(color.data()); }

// Degrees.
float Hue(const Vector3f& color) { return std::atan2(Lab(color).b, Lab(color).a) * 57.29578f; }
float Chroma(const Vector3f& color) { return std::hypot(Lab(color).a, Lab(color).b); }

void ExpectColor(const Vector3f& color, const Vector3f& expected, float tolerance = 1e-5f) {
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(color[c], expected[c], tolerance) << color.transpose();
}

TEST(ColorEditTest, TintFiltersByTheMask) {
  const CompiledEdit edit(ColorEdit::Tint({0.5f, 1.0f, 2.0f}));
  const Vector3f color(0.4f, 0.6f, 0.2f);
  ExpectColor(edit.Apply(color, 1), {0.2f, 0.6f, 0.4f}, 1e-7f);
  ExpectColor(edit.Apply(color, 0.5f), {0.3f, 0.6f, 0.3f}, 1e-7f);
  EXPECT_EQ(edit.Apply(color, 0), color);
}

TEST(ColorEditTest, StrengthInterpolatesFromIdentity) {
  AffineColor map;
  map.gain.diagonal() = Vector3f(0, 1, 3);
  map.gain(0, 2) = 0.5f;
  map.offset = {0.25f, 0, 0};
  const ColorEdit edit = ColorEdit::FromAffine(map);
  EXPECT_EQ(edit.WithStrength(0).Affine().gain, Eigen::Matrix3f(Eigen::Matrix3f::Identity()));
  EXPECT_EQ(edit.WithStrength(0).Affine().offset, Vector3f(0, 0, 0));
  EXPECT_EQ(edit.WithStrength(1).Affine().gain, map.gain);
  const AffineColor half = edit.WithStrength(0.5f).Affine();
  EXPECT_EQ(half.gain.diagonal(), Vector3f(0.5f, 1, 2));
  EXPECT_EQ(half.gain(0, 2), 0.25f);
  EXPECT_EQ(half.offset[0], 0.125f);
  // The same of a list that is not affine.
  const ColorEdit gamma = Edit(Kind::kGamma, {2});
  const Vector3f color(0.25f, 0.5f, 1);
  const Vector3f full = Apply(gamma, color);
  ExpectColor(Apply(gamma.WithStrength(0.5f), color), 0.5f * (color + full), 1e-6f);
}

TEST(ColorEditTest, AffineListsAreOneMap) {
  const ColorEdit list =
      Edit({ColorOperation::Make(Kind::kTint, {0.5f, 1, 0.25f}),
            ColorOperation::Make(Kind::kInvert), ColorOperation::Make(Kind::kContrast, {1.5f}),
            ColorOperation::Make(Kind::kSaturation, {0.3f})});
  ASSERT_TRUE(list.IsAffine());
  const Vector3f color(0.8f, 0.3f, 0.6f);
  Vector3f expected = Vector3f::Ones() - color.cwiseProduct(Vector3f(0.5f, 1, 0.25f));
  expected = (1.5f * (expected.array() - 0.5f) + 0.5f).matrix();
  const float luma = Vector3f(0.2126f, 0.7152f, 0.0722f).dot(expected);
  expected = (luma + 0.3f * (expected.array() - luma)).matrix();
  ExpectColor(Apply(list, color), expected);
  EXPECT_FALSE(Edit({list.operations[0], ColorOperation::Make(Kind::kGray)}).IsAffine());
}

TEST(ColorEditTest, OneTintKeepsItsBits) {
  const ColorEdit edit = ColorEdit::Tint({0.1f, 0.7f, 1.3f});
  EXPECT_EQ(edit.Affine().gain.diagonal(), Vector3f(0.1f, 0.7f, 1.3f));
  EXPECT_EQ(edit.Affine().offset, Vector3f(0, 0, 0));
}

TEST(ColorEditTest, GradesInLinearLight) {
  const Vector3f color(0.5f, 0.3f, 0.2f);
  const Vector3f brighter = Apply(Edit(Kind::kExposure, {1}), color);
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(LinearFromSrgb(brighter[c]), 2 * LinearFromSrgb(color[c]), 1e-5f);
  }
  const Vector3f gray = Apply(Edit(Kind::kGray), color);
  const float luminance = 0.2126f * LinearFromSrgb(0.5f) + 0.7152f * LinearFromSrgb(0.3f) +
                          0.0722f * LinearFromSrgb(0.2f);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(gray[c], SrgbFromLinear(luminance), 1e-5f);
  ExpectColor(Apply(Edit(Kind::kGamma, {2}), {0.25f, 0.04f, 1}), {0.5f, 0.2f, 1});
}

TEST(ColorEditTest, WhiteBalanceWarmsAndKeepsLuminance) {
  const Vector3f gray(0.5f, 0.5f, 0.5f);
  ExpectColor(Apply(Edit(Kind::kWhiteBalance, {0, 0}), gray), gray);
  const Vector3f warm = Apply(Edit(Kind::kWhiteBalance, {50, 0}), gray);
  const Vector3f cool = Apply(Edit(Kind::kWhiteBalance, {-50, 0}), gray);
  const Vector3f magenta = Apply(Edit(Kind::kWhiteBalance, {0, 50}), gray);
  EXPECT_GT(warm[0], warm[1]);
  EXPECT_GT(warm[1], warm[2]);
  EXPECT_LT(cool[0], cool[1]);
  EXPECT_LT(cool[1], cool[2]);
  EXPECT_LT(magenta[1], std::min(magenta[0], magenta[2]));
  for (const Vector3f& color : {warm, cool, magenta}) {
    const float luminance = 0.2126f * LinearFromSrgb(color[0]) +
                            0.7152f * LinearFromSrgb(color[1]) + 0.0722f * LinearFromSrgb(color[2]);
    EXPECT_NEAR(luminance, LinearFromSrgb(0.5f), 1e-5f);
  }
  // 153.8 + 50 mired are 4908 K; CIE daylight of that temperature is about (1.2, 1, 0.7) of D65's
  // linear red, green and blue. Black bodies differ from it by a few percent.
  EXPECT_NEAR(LinearFromSrgb(warm[0]) / LinearFromSrgb(warm[1]), 1.25f, 0.1f);
  EXPECT_NEAR(LinearFromSrgb(warm[2]) / LinearFromSrgb(warm[1]), 0.68f, 0.1f);
}

TEST(ColorEditTest, AdjustTurnsHueAndScales) {
  const Vector3f red(0.6f, 0.3f, 0.3f);
  ColorOperation op = ColorOperation::Make(Kind::kAdjust, {120, 0.5f, 0.9f});
  const Vector3f turned = Apply(Edit({op}), red);
  EXPECT_NEAR(Hue(turned) - Hue(red), 120, 0.1f);
  EXPECT_NEAR(Chroma(turned), 0.5f * Chroma(red), 1e-4f);
  EXPECT_NEAR(Lab(turned).lightness, 0.9f * Lab(red).lightness, 1e-4f);
}

TEST(ColorEditTest, AdjustKeepsToItsRange) {
  const Vector3f red(0.7f, 0.2f, 0.2f), green(0.2f, 0.6f, 0.3f), gray(0.5f, 0.5f, 0.5f);
  ColorOperation op = ColorOperation::Make(Kind::kAdjust, {90, 1.2f, 1.1f});
  const float hue = Hue(red);
  op.Get("hues")[0] = hue - 20 + 360;  // across 0
  op.Get("hues")[1] = hue + 20;
  if (op.Get("hues")[0] > 360) op.Get("hues")[0] -= 360;
  EXPECT_GT((Apply(Edit({op}), red) - red).norm(), 0.2f);
  EXPECT_EQ(Apply(Edit({op}), green), green);
  EXPECT_EQ(Apply(Edit({op}), gray), gray);
  // Half way down the soft edge, half of the change.
  op.Get("hues")[0] = std::fmod(hue + 360 - 27.5f, 360.0f);
  op.Get("hues")[1] = std::fmod(hue + 360 - 7.5f, 360.0f);
  const Vector3f full = Apply(Edit({ColorOperation::Make(Kind::kAdjust, {90, 1.2f, 1.1f})}), red);
  ExpectColor(Apply(Edit({op}), red), 0.5f * (red + full), 2e-3f);
  // Without a soft edge it is all or nothing.
  op.Get("hue_edge")[0] = 0;
  EXPECT_EQ(Apply(Edit({op}), red), red);
  op.Get("hues")[1] = std::fmod(hue + 360 + 5.0f, 360.0f);
  ExpectColor(Apply(Edit({op}), red), full);
  ColorOperation dark = ColorOperation::Make(Kind::kAdjust, {0, 0});
  dark.Get("lightnesses")[1] = 0.3f;
  EXPECT_EQ(Apply(Edit({dark}), red), red);
}

ColorOperation Recolor(const Vector3f& from, const Vector3f& to, float keep = 0) {
  return ColorOperation::Make(Kind::kRecolor,
                              {to[0], to[1], to[2], keep, from[0], from[1], from[2], 1.5f});
}

float SceneOf(float encoded) { return SceneFromDisplay(LinearFromSrgb(encoded)); }

// A color in `light` of its own, in the scene's light, with `gloss` of white.
Vector3f Lit(const Vector3f& color, float light, float gloss = 0) {
  Vector3f lit;
  for (int c = 0; c < 3; ++c) {
    lit[c] = SrgbFromLinear(DisplayFromScene(light * SceneOf(color[c]) + gloss));
  }
  return lit;
}

TEST(ColorEditTest, RecolorTakesTheMainColorToTheTarget) {
  const Vector3f mains[] = {{0.85f, 0.75f, 0.1f}, {0.7f, 0.1f, 0.1f}, {0.8f, 0.78f, 0.75f},
                            {0.3f, 0.3f, 0.3f},   {0.1f, 0.2f, 0.5f}, {0.05f, 0.05f, 0.05f}};
  const Vector3f targets[] = {{0.19f, 0.38f, 1}, {0.9f, 0.9f, 0.9f}, {0.1f, 0.5f, 0.2f}};
  for (const Vector3f& from : mains) {
    for (const Vector3f& to : targets) {
      // Rounding, which the encoding magnifies near black.
      ExpectColor(Apply(Edit({Recolor(from, to)}), from), to, 1e-3f);
    }
  }
}

TEST(ColorEditTest, RecolorKeepsShadingAndHighlights) {
  const Vector3f yellow(0.85f, 0.7f, 0.15f), blue(0.19f, 0.38f, 0.9f);
  const CompiledEdit edit(Edit({Recolor(yellow, blue)}));
  for (const float light : {0.2f, 0.5f, 1.0f, 1.15f}) {
    ExpectColor(edit.Apply(Lit(yellow, light)), Lit(blue, light), 0.02f);
  }
  // Gloss adds the same white to either, and a little less to a channel that is nearly white. From
  // a fifth of the light on it is gloss alone.
  for (const float gloss : {0.25f, 0.8f, 2.0f}) {
    ExpectColor(edit.Apply(Lit(yellow, 0.8f, gloss)), Lit(blue, 0.8f, gloss), 0.03f);
  }
  const Vector3f highlight = edit.Apply({1, 1, 1});
  EXPECT_GT(highlight.minCoeff(), 0.9f);
  EXPECT_LT(Chroma(highlight), 0.05f);
}

// If the new color leaves the gamut, shading still shows, in the same hue. A pixel with
// four times the light of the main color becomes lighter, but no less blue than a screen
// shows.
TEST(ColorEditTest, RecolorOfWhatIsBrightKeepsTheHue) {
  const Vector3f gray(0.4f, 0.4f, 0.4f), blue(0.19f, 0.38f, 1);
  ColorOperation op = Recolor(gray, blue);
  op.Get("brightest")[0] = 5;
  const Vector3f lit = Apply(Edit({op}), Vector3f(0.75f, 0.75f, 0.75f));
  const OkLab found = OkLabFromSrgb(lit.data()), target = OkLabFromSrgb(blue.data());
  EXPECT_GT(found.lightness, target.lightness);
  // Blue with white in it looks a little more violet.
  EXPECT_NEAR(std::atan2(found.b, found.a), std::atan2(target.b, target.a), 0.07f);
  EXPECT_GT(std::hypot(found.a, found.b), 0.1f);
  EXPECT_LE(lit.maxCoeff(), 1.001f);
}

TEST(ColorEditTest, RecolorStaysInTheGamutAndKeepsVariation) {
  const Vector3f red(0.7f, 0.1f, 0.08f), blue(0.19f, 0.38f, 1.0f);
  const CompiledEdit edit(Edit({Recolor(red, blue)}));
  float last = 0;
  for (const float light : {0.8f, 1.0f, 1.2f, 1.4f, 1.6f}) {
    const Vector3f color = edit.Apply(Lit(red, light));
    EXPECT_GT(color.minCoeff(), -2e-3f) << light;  // the room for rounding, encoded
    EXPECT_LT(color.maxCoeff(), 1 + 2e-3f) << light;
    EXPECT_NEAR(Hue(color), Hue(blue), 1.5f) << light;
    // The cube root of a step of light by at least an eighth, gloss included.
    EXPECT_GT(Lab(color).lightness, 1.02f * last) << light;
    last = Lab(color).lightness;
  }
}

// If white is close to the main color, a paler and a darker pattern stay a pattern. Only pixels
// brighter than the surface stay white.
TEST(ColorEditTest, RecolorTakesPalePatternsForTheSurface) {
  const Vector3f cream(0.75f, 0.7f, 0.62f), blue(0.1f, 0.2f, 0.6f);
  const CompiledEdit edit(Edit({Recolor(cream, blue)}));
  for (const float light : {0.5f, 1.5f}) {
    const Vector3f pattern = Lit({0.7f, 0.7f, 0.7f}, light);
    const Vector3f edited = edit.Apply(pattern);
    EXPECT_NEAR(Hue(edited), Hue(blue), 6) << light;  // a little of the pattern's hue stays
    EXPECT_GT(Chroma(edited), 0.8f * Chroma(Lit(blue, light))) << light;
  }
  EXPECT_LT(Chroma(edit.Apply({1, 1, 1})), 0.5f * Chroma(blue));
}

TEST(ColorEditTest, RecolorKeepsVariationOfHueInProportion) {
  const Vector3f yellow(0.8f, 0.7f, 0.3f), reddish(0.8f, 0.6f, 0.3f), blue(0.2f, 0.35f, 0.8f);
  const CompiledEdit edit(Edit({Recolor(yellow, blue)}));
  // Towards magenta, not towards cyan; by less than the pattern differed.
  const float turn = Hue(edit.Apply(reddish)) - Hue(blue);
  EXPECT_GT(turn, 0.5f);
  EXPECT_LT(turn, std::abs(Hue(reddish) - Hue(yellow)));
  // A gray has no hues to vary.
  const Vector3f gray = Apply(Edit({Recolor(yellow, {0.5f, 0.5f, 0.5f})}), reddish);
  EXPECT_LT(Chroma(gray), 2e-3f);
}

TEST(ColorEditTest, RecolorKeepsLightnessOnRequest) {
  const Vector3f yellow(0.85f, 0.7f, 0.15f), blue(0.19f, 0.38f, 0.9f);
  for (const float light : {0.3f, 1.0f}) {
    const Vector3f color = Lit(yellow, light);
    const Vector3f kept = Apply(Edit({Recolor(yellow, blue, 1)}), color);
    EXPECT_NEAR(Lab(kept).lightness, Lab(color).lightness, 1e-3f);
    // Hues a degree apart look the same; negative values in the way round a little.
    EXPECT_NEAR(Hue(kept), Hue(blue), 3);
  }
}

TEST(ColorEditTest, RecolorWaitsForItsMainColor) {
  const ColorEdit edit = Edit(Kind::kRecolor, {0, 0, 1});
  EXPECT_TRUE(edit.NeedsMainColor());
  EXPECT_NO_THROW(edit.Check());
  EXPECT_THROW(CompiledEdit{edit}, OptionError);
  EXPECT_FALSE(Edit({Recolor({1, 0, 0}, {0, 0, 1})}).NeedsMainColor());
}

TEST(ColorEditTest, GradientMapsByLightness) {
  const ColorEdit edit =
      Edit(Kind::kGradient, {0, 0, 0, 0.2f, 0.5f, 0.8f, 0.3f, 0.1f, 1, 1, 1, 0.9f});
  ExpectColor(Apply(edit, {0, 0, 0}), {0, 0, 0.2f});
  ExpectColor(Apply(edit, {1, 1, 1}), {1, 1, 0.9f}, 1e-4f);
  Vector3f middle;
  SrgbFromOkLab({0.5f, 0, 0}, middle.data());
  // Between two of 256 entries.
  ExpectColor(Apply(edit, middle), {0.8f, 0.3f, 0.1f}, 5e-3f);
}

TEST(ColorEditTest, LutLooksColorsUp) {
  auto table = std::make_shared<ColorTable>();
  table->size = 2;
  for (int i = 0; i < 8; ++i) {
    for (const int bit : {2, 1, 0}) table->values.push_back(float(i >> bit & 1));
  }
  ExpectColor(Apply(Edit({ColorOperation::Lut(table)}), {0.1f, 0.6f, 0.9f}), {0.9f, 0.6f, 0.1f});
}

TEST(ColorEditTest, ColorsCanBeLeftOutOfRange) {
  const ColorEdit exposed =
      Edit({ColorOperation::Make(Kind::kExposure, {2}), ColorOperation::Make(Kind::kSoftClip)});
  const Vector3f color(0.9f, 0.5f, 0.2f);
  EXPECT_LE(Apply(exposed, color).maxCoeff(), 1);
  EXPECT_GT(CompiledEdit(exposed, OutOfRange::kLeft).Apply(color).maxCoeff(), 1.5f);
}

// The new colors of a uniform surface in more and more light.
std::vector<Vector3f> InMoreLight(const Vector3f& from, const ColorEdit& edit) {
  const CompiledEdit compiled(edit);
  std::vector<Vector3f> colors;
  for (int i = 0; i <= 100; ++i)
    colors.push_back(compiled.Apply(Lit(from, 0.3f + 0.018f * float(i))));
  return colors;
}

// Light targets leave little room to white. The surface goes on to become lighter there, and never
// reaches it. White itself becomes a little darker, so that there is room.
TEST(ColorEditTest, RecolorKeepsTheTextureOfLightTargets) {
  const Vector3f from(0.6f, 0.4f, 0.2f);
  for (const Vector3f& to : {Vector3f(1, 1, 1), Vector3f(0.96f, 0.96f, 0.96f), Vector3f(1, 1, 0)}) {
    const std::vector<Vector3f> colors = InMoreLight(from, Edit({Recolor(from, to)}));
    for (size_t i = 1; i < colors.size(); ++i) {
      EXPECT_GT(Lab(colors[i]).lightness, Lab(colors[i - 1]).lightness + 5e-5f) << i;
      EXPECT_LE(colors[i].maxCoeff(), 1.001f) << i;
      EXPECT_GE(colors[i].minCoeff(), -2e-3f) << i;  // the room for rounding, encoded
    }
    EXPECT_LT(Lab(colors.back()).lightness, 0.995f);
  }
  ExpectColor(Apply(Edit({Recolor(from, {1, 1, 1})}), from), Vector3f::Constant(0.973691f), 1e-4f);
}

// Of a surface in 1.8 times the light of its main color, by the formulas in double precision: a
// target with room below white becomes lighter, the others also paler.
TEST(ColorEditTest, RecolorCompressesMuchLight) {
  const Vector3f from(0.6f, 0.4f, 0.2f), lit = Lit(from, 1.8f), blue(0.19f, 0.38f, 1);
  const auto recolored = [&](const Vector3f& to, float keep) {
    return Apply(Edit({Recolor(from, to, keep)}), lit);
  };
  ExpectColor(recolored({0.1f, 0.5f, 0.2f}, 0), {0.137102f, 0.592987f, 0.258730f}, 1e-4f);
  ExpectColor(recolored({1, 1, 1}, 0), {0.983297f, 0.983297f, 0.983297f}, 1e-4f);
  ExpectColor(recolored({1, 1, 0}, 0), {1, 1, 0.630118f}, 1e-4f);
  ExpectColor(recolored(blue, 0), {0.306114f, 0.476686f, 1}, 1e-4f);
  ExpectColor(recolored(blue, 0.5f), {0.324783f, 0.494258f, 1.000038f}, 1e-3f);
}

// Whatever the colors are.
TEST(ColorEditTest, RecolorLeavesNoColorOutOfRange) {
  constexpr float kValues[] = {0, 0.02f, 0.5f, 1};
  const auto color = [&](int i) {
    return Vector3f(kValues[i & 3], kValues[i >> 2 & 3], kValues[i >> 4 & 3]);
  };
  for (const float keep : {0.0f, 0.5f}) {
    for (int from = 0; from < 64; from += 3) {
      for (int to = 0; to < 64; ++to) {
        const CompiledEdit edit(Edit({Recolor(color(from), color(to), keep)}));
        for (int i = 0; i < 64; i += 5) {
          const Vector3f edited = edit.Apply(color(i));
          ASSERT_FALSE(LeavesGamut(edited.data()))
              << color(from).transpose() << " to " << color(to).transpose() << ": "
              << color(i).transpose() << " becomes " << edited.transpose();
        }
      }
    }
  }
}

TEST(ColorEditTest, CheckRefusesWhatIsNoEdit) {
  EXPECT_NO_THROW(ColorEdit().Check());
  EXPECT_THROW(ColorEdit::Tint({-0.1f, 1, 1}).Check(), OptionError);
  EXPECT_THROW(ColorEdit::Tint({kNan, 1, 1}).Check(), OptionError);
  EXPECT_THROW(Edit(Kind::kGamma, {0}).Check(), OptionError);
  EXPECT_THROW(Edit(Kind::kExposure, {kNan}).Check(), OptionError);
  EXPECT_THROW(Edit(Kind::kGradient, {0, 0, 0, 0}).Check(), OptionError);
  EXPECT_THROW(Edit(Kind::kGradient, {0.5f, 0, 0, 0, 0.5f, 1, 1, 1}).Check(), OptionError);
  EXPECT_THROW(Edit(Kind::kLut).Check(), OptionError);
  EXPECT_THROW(ColorEdit().WithStrength(2).Check(), OptionError);
  EXPECT_THROW(Edit(std::vector<ColorOperation>(17, ColorOperation::Make(Kind::kGray))).Check(),
               OptionError);
  ColorOperation empty = ColorOperation::Make(Kind::kAdjust, {30});
  empty.Get("chromas")[0] = 0.2f;
  empty.Get("chromas")[1] = 0.1f;
  EXPECT_THROW(Edit({empty}).Check(), OptionError);
  for (const ColorOperationType& type : ColorOperationTypes()) {
    EXPECT_EQ(&TypeOf(type.kind), &type);  // the table is in the order of the enum
    EXPECT_EQ(FindOperationType(type.name), &type);
  }
}

TEST(ParseTintTest, TakesNumbersAndHex) {
  const auto diagonal = [](const char* text) {
    return Vector3f(ParseTint(text).Affine().gain.diagonal());
  };
  EXPECT_EQ(diagonal("1,0.5,0"), Vector3f(1, 0.5f, 0));
  EXPECT_EQ(diagonal(" 2 , 1e-1 ,.25 "), Vector3f(2, 0.1f, 0.25f));
  EXPECT_EQ(diagonal("#3060ff"), Vector3f(48.0f / 255, 96.0f / 255, 1.0f));
  EXPECT_EQ(diagonal("#FFffFF"), Vector3f(1, 1, 1));
  EXPECT_EQ(ParseTint("1,1,1").Affine().offset, Vector3f(0, 0, 0));
}

TEST(ParseTintTest, RefusesTheRest) {
  for (const char* text :
       {"",        " ",      "1",        "1,2",     "1,2,3,4", "a,b,c",  "1,,2",
        "1,2,",    "-1,0,0", "nan,0,0",  "inf,0,0", "1;2;3",   "#fff",   "#3060f",
        "#3060fg", "3060ff", "1e99,0,0", "1 2,0,0", "##30fff", "#-13060"}) {
    EXPECT_THROW(ParseTint(text), OptionError) << text;
  }
}

}  // namespace
}  // namespace retint
