// SPDX-License-Identifier: BSD-3-Clause
#include "kernels/edit_colors.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace retint {
namespace {

TEST(ColorSpacesTest, EncodesAsTheStandardSays) {
  // IEC 61966-2-1, computed in double precision; floats have seven digits.
  EXPECT_NEAR(LinearFromSrgb(0.5f), 0.21404114, 1e-6);
  EXPECT_NEAR(LinearFromSrgb(0.04f), 0.04 / 12.92, 1e-7);
  EXPECT_NEAR(SrgbFromLinear(0.18f), 0.46135613, 1e-6);
  for (const float x : {-0.7f, -0.01f, 0.0f, 0.003f, 0.2f, 1.0f, 1.7f}) {
    EXPECT_NEAR(SrgbFromLinear(LinearFromSrgb(x)), x, 1e-6);
  }
}

TEST(ColorSpacesTest, ToneCurveIsReinhards) {
  // Equation 4 of the paper in double precision; floats have seven digits.
  for (const double x : {0.001, 0.18, 1.0, 6.0, 9.0}) {
    const double y = x * (1 + x / 36) / (1 + x);
    EXPECT_NEAR(DisplayFromScene(float(x)), y, 1e-6 * y);
    // The curve is flat at its top, where an error of the display's light grows twelvefold.
    EXPECT_NEAR(SceneFromDisplay(float(y)), x, 1e-5 * x);
  }
  EXPECT_NEAR(DisplayFromScene(kSceneWhite), 1, 1e-6);
  EXPECT_EQ(SceneFromDisplay(0), 0);
  EXPECT_EQ(SceneFromDisplay(-0.5f), -SceneFromDisplay(0.5f));
}

TEST(ColorSpacesTest, GivesThePublishedOkLab) {
  // B. Ottosson, "A perceptual color space for image processing" (2020): pairs of XYZ and OKLab of
  // three decimals.
  const struct {
    double xyz[3];
    OkLab lab;
  } known[] = {{{0.950, 1.000, 1.089}, {1.000f, 0.000f, 0.000f}},
               {{1, 0, 0}, {0.450f, 1.236f, -0.019f}},
               {{0, 1, 0}, {0.922f, -0.671f, 0.263f}},
               {{0, 0, 1}, {0.153f, -1.415f, -0.449f}}};
  constexpr double kRgbFromXyz[3][3] = {{3.2404542, -1.5371385, -0.4985314},
                                        {-0.9692660, 1.8760108, 0.0415560},
                                        {0.0556434, -0.2040259, 1.0572252}};
  for (const auto& [xyz, expected] : known) {
    float rgb[3];
    for (int c = 0; c < 3; ++c) {
      const auto& row = kRgbFromXyz[c];
      rgb[c] = float(row[0] * xyz[0] + row[1] * xyz[1] + row[2] * xyz[2]);
    }
    const OkLab lab = OkLabFromLinear(rgb);
    // Half a unit of the third decimal, and the rounding of the two matrices.
    EXPECT_NEAR(lab.lightness, expected.lightness, 1.5e-3);
    EXPECT_NEAR(lab.a, expected.a, 1.5e-3);
    EXPECT_NEAR(lab.b, expected.b, 1.5e-3);
  }
  // CSS Color 4's oklab() of red and blue.
  const float red[3] = {1, 0, 0}, blue[3] = {0, 0, 1};
  EXPECT_NEAR(OkLabFromSrgb(red).lightness, 0.62796, 1e-4);
  EXPECT_NEAR(OkLabFromSrgb(red).a, 0.22486, 1e-4);
  EXPECT_NEAR(OkLabFromSrgb(red).b, 0.12585, 1e-4);
  EXPECT_NEAR(OkLabFromSrgb(blue).lightness, 0.45201, 1e-4);
  EXPECT_NEAR(OkLabFromSrgb(blue).a, -0.03246, 1e-4);
  EXPECT_NEAR(OkLabFromSrgb(blue).b, -0.31153, 1e-4);
}

TEST(ColorSpacesTest, GoesThereAndBack) {
  std::mt19937 rng(7);
  std::uniform_real_distribution<float> uniform(0, 1.2f);
  for (int i = 0; i < 1000; ++i) {
    const float rgb[3] = {uniform(rng), uniform(rng), uniform(rng)};
    float back[3];
    SrgbFromOkLab(OkLabFromSrgb(rgb), back);
    // The published inverse has ten digits; near black the encoding's slope is 12.92.
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(back[c], rgb[c], 2e-4);
  }
}

ColorOp Op(ColorOpCode code, std::initializer_list<float> values, float strength = 1) {
  ColorOp op{};
  op.code = code;
  op.strength = strength;
  std::copy(values.begin(), values.end(), op.values);
  return op;
}

TEST(ColorSpacesTest, FindsTheBorderOfTheGamut) {
  std::mt19937 rng(0);
  std::uniform_real_distribution<float> uniform(0, 1);
  constexpr float kMost = 1.25f;
  const auto beyond = [](const OkLab& lab) {  // by how much a channel leaves the gamut
    float rgb[3], most = -1;
    LinearFromOkLab(lab, rgb);
    for (const float value : rgb) most = std::max({most, value - 1, -value});
    return most - kGamutRounding;
  };
  int crossed = 0;
  for (int i = 0; i < 1000; ++i) {
    const OkLab lab = {uniform(rng), 0.6f * uniform(rng) - 0.3f, 0.6f * uniform(rng) - 0.3f};
    const float reach = GamutReach(lab, kMost);
    const OkLab there = {lab.lightness, reach * lab.a, reach * lab.b};
    if (reach == kMost) {
      EXPECT_LE(beyond(there), 0);
      continue;
    }
    ++crossed;
    // The square of the last two points' distance, 1.25 / 512, by some curvature.
    EXPECT_NEAR(beyond(there), 0, 1e-5f);
  }
  EXPECT_GT(crossed, 300);
  EXPECT_EQ(GamutReach({1.1f, 0.1f, 0}, kMost), 0);  // no gray is as bright
}

TEST(ColorSpacesTest, CompressesChromaAtAnyKnee) {
  const OkLab violet = {0.75f, -0.05f, -0.25f};  // twice as far from gray as the gamut reaches
  float last = 0;
  for (const float knee : {0.0f, 0.001f, 0.05f, 0.3f, 0.8f, 1.0f}) {
    OkLab lab = violet;
    CompressChroma(knee, &lab);
    float rgb[3];
    EXPECT_TRUE(IsInGamut(lab, rgb)) << knee;
    EXPECT_NEAR(lab.b, 5 * lab.a, 1e-5f) << knee;
    // The more is compressed, the less is left; two thirds of the gamut at least.
    const float chroma = std::hypot(lab.a, lab.b);
    EXPECT_GE(chroma, last) << knee;
    EXPECT_GT(chroma, 0.085f) << knee;
    last = chroma;
  }
}

TEST(ColorOpsTest, MixesByTheStrengthAndRunsInOrder) {
  ColorProgram program{};
  program.strength = 1;
  program.ops[program.count++] =
      Op(ColorOpCode::kMatrix, {0, 1, 0, 0, 1, 0, 0, 0.5f, 0, 0, 2, 0}, 0.5f);
  program.ops[program.count++] = Op(ColorOpCode::kPower, {2});
  float color[3] = {0.2f, 0.4f, 0.3f};
  RunColorProgram(program, color);
  // Half of (0.2, 0.4, 0.3) and half of (0.4, 0.7, 0.6), squared.
  EXPECT_NEAR(color[0], 0.3f * 0.3f, 1e-6);
  EXPECT_NEAR(color[1], 0.55f * 0.55f, 1e-6);
  EXPECT_NEAR(color[2], 0.45f * 0.45f, 1e-6);
}

TEST(ColorOpsTest, ExposureIsLinearLight) {
  ColorProgram program{};
  program.strength = 1;
  program.ops[program.count++] = Op(ColorOpCode::kLinearMatrix, {2, 0, 0, 0, 2, 0, 0, 0, 2});
  float color[3] = {0.1f, 0.5f, -0.2f};
  RunColorProgram(program, color);
  EXPECT_NEAR(LinearFromSrgb(color[0]), 2 * LinearFromSrgb(0.1f), 1e-6);
  EXPECT_NEAR(LinearFromSrgb(color[1]), 2 * LinearFromSrgb(0.5f), 1e-6);
  EXPECT_NEAR(LinearFromSrgb(color[2]), -2 * LinearFromSrgb(0.2f), 1e-6);
}

// A table of an affine map, which tetrahedra reproduce exactly.
std::vector<float> AffineTable(int size) {
  std::vector<float> table;
  for (int b = 0; b < size; ++b) {
    for (int g = 0; g < size; ++g) {
      for (int r = 0; r < size; ++r) {
        const float x = float(r) / float(size - 1), y = float(g) / float(size - 1),
                    z = float(b) / float(size - 1);
        table.insert(table.end(), {0.1f + 0.5f * x - 0.2f * y + 0.3f * z, y, 1 - z});
      }
    }
  }
  return table;
}

TEST(ColorOpsTest, TetrahedraReproduceAffineMaps) {
  std::mt19937 rng(3);
  std::uniform_real_distribution<float> uniform(0, 1);
  for (const int size : {2, 5, 33}) {
    const std::vector<float> table = AffineTable(size);
    const auto check = [&](float r, float g, float b) {
      float color[3] = {r, g, b};
      TableColor(table.data(), size, color);
      EXPECT_NEAR(color[0], 0.1f + 0.5f * r - 0.2f * g + 0.3f * b, 1e-5);
      EXPECT_NEAR(color[1], g, 1e-5);
      EXPECT_NEAR(color[2], 1 - b, 1e-5);
    };
    for (int i = 0; i < 500; ++i) check(uniform(rng), uniform(rng), uniform(rng));
    // All orders of equal and extreme fractions.
    for (const float r : {0.0f, 0.3f, 0.6f, 1.0f}) {
      for (const float g : {0.0f, 0.3f, 0.6f, 1.0f}) {
        for (const float b : {0.0f, 0.3f, 0.6f, 1.0f}) check(r, g, b);
      }
    }
  }
}

TEST(ColorOpsTest, TetrahedraKeepGraysOnTheDiagonal) {
  // Only the cell's black and white corners count for a gray, whatever the other six hold.
  std::vector<float> table(24, 9.0f);
  std::fill_n(table.begin(), 3, 0.0f);
  std::fill_n(table.end() - 3, 3, 1.0f);
  float color[3] = {0.25f, 0.25f, 0.25f};
  TableColor(table.data(), 2, color);
  for (const float value : color) EXPECT_EQ(value, 0.25f);
}

TEST(ColorOpsTest, TableTakesColorsOutsideToItsBorder) {
  const std::vector<float> table = AffineTable(4);
  float outside[3] = {1.5f, -0.5f, 0.5f}, border[3] = {1, 0, 0.5f};
  TableColor(table.data(), 4, outside);
  TableColor(table.data(), 4, border);
  for (int c = 0; c < 3; ++c) EXPECT_EQ(outside[c], border[c]);
}

// Large colors overflow, and their differences are no numbers.
TEST(ColorOpsTest, TablesTakeWhatIsNoNumberForZero) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<float> table = AffineTable(4);
  float color[3] = {nan, 0.5f, nan}, zero[3] = {0, 0.5f, 0};
  TableColor(table.data(), 4, color);
  TableColor(table.data(), 4, zero);
  for (int c = 0; c < 3; ++c) EXPECT_EQ(color[c], zero[c]);
  float infinite[3] = {INFINITY, INFINITY, INFINITY};
  GradientColor(table.data(), 4, infinite);
  for (int c = 0; c < 3; ++c) EXPECT_EQ(infinite[c], table[size_t(c)]);
}

TEST(ColorOpsTest, ACurveGoesThereAndBack) {
  // 0 up to 0.5, then rising by 1 a step of 0.5.
  const float curve[5] = {0, 0, 1, 2, 3};
  float color[3] = {0.25f, 0.75f, 4};
  CurveColor(curve, 5, color);
  EXPECT_EQ(color[0], 0);
  EXPECT_EQ(color[1], 0.5f);
  EXPECT_EQ(color[2], 7);  // it goes on straight
  InverseCurveColor(curve, 5, color);
  EXPECT_EQ(color[0], 0);  // the least of many
  EXPECT_EQ(color[1], 0.75f);
  EXPECT_EQ(color[2], 4);
  float below[3] = {-1, -1, -1};
  InverseCurveColor(curve, 5, below);
  for (const float value : below) EXPECT_EQ(value, 0);
  float invalid[3] = {NAN, -1, INFINITY};  // none of them may index the curve
  CurveColor(curve, 5, invalid);
  EXPECT_EQ(invalid[0], 0);
  EXPECT_EQ(invalid[1], 0);
}

TEST(ColorOpsTest, SoftClipBringsEveryColorIn) {
  std::mt19937 rng(5);
  std::uniform_real_distribution<float> uniform(-1, 2);
  for (int i = 0; i < 2000; ++i) {
    float color[3] = {uniform(rng), uniform(rng), uniform(rng)};
    SoftClipColor(0.8f, color);
    for (const float value : color) {
      EXPECT_GE(value, 0);
      EXPECT_LE(value, 1);
    }
  }
  // Well inside nothing changes; luma stays wherever it is one of the screen's.
  float inside[3] = {0.4f, 0.5f, 0.6f};
  SoftClipColor(0.8f, inside);
  EXPECT_EQ(inside[0], 0.4f);
  float saturated[3] = {0.9f, -0.2f, 0.3f};
  const float luma = 0.2126f * 0.9f - 0.7152f * 0.2f + 0.0722f * 0.3f;
  SoftClipColor(0.8f, saturated);
  EXPECT_NEAR(0.2126f * saturated[0] + 0.7152f * saturated[1] + 0.0722f * saturated[2], luma, 1e-6);
}

// Every operation for several colors at once, as for one. A channel near black may come from large
// ones, and the encoding's slope is 12.92 there: an error of 3e-7 grows a hundredfold.
TEST(EditColorsTest, EditsManyColorsAsItEditsOne) {
  constexpr size_t kColors = 20011;  // no whole vectors
  constexpr double kTolerance = 3e-5;
  std::mt19937 rng(11);
  std::uniform_real_distribution<float> uniform(0, 1), beyond(-0.2f, 1.3f);
  std::vector<float> tables(3 * 17 + 3 * 125 + 3 * kPaletteRow);
  for (float& value : tables) value = uniform(rng);
  constexpr int kCurve = 33;
  const auto curve_at = int32_t(tables.size());
  for (int i = 0; i < kCurve; ++i) {
    const float x = kCurveEnd * float(i) / (kCurve - 1);
    tables.push_back(0.5f * x * (1 + x));
  }
  ColorOp gradient = Op(ColorOpCode::kGradient, {}), table = Op(ColorOpCode::kTable, {}),
          palette = Op(ColorOpCode::kPalette, {0.5f});
  gradient.size = 17;
  table.table = 3 * 17;
  table.size = 5;
  palette.table = 3 * 17 + 3 * 125;
  palette.size = 3;
  const auto recolor = [](float limit, float kept, float lightness = 0.6f, float half_way = 0.5f) {
    return Op(ColorOpCode::kRecolor, {1.9f, 0.78f, 0.53f, 0.03f, 0.2f, 0.9f, -0.2f, 0.3f, 0.9f,
                                      0.8f, 0.3f, 0.25f, 0.7f, limit, kept, lightness, half_way});
  };
  const ColorOp ops[] = {
      Op(ColorOpCode::kMatrix, {1, 0.2f, 0.1f, 0.1f, 0, 1, 0, 0, 0.3f, 0, 0.5f, 0.1f}),
      Op(ColorOpCode::kLinearMatrix, {1, 0.2f, 0.1f, 0.1f, 1, 0, 0.3f, 0, 0.5f}, 0.4f),
      Op(ColorOpCode::kPower, {1 / 2.2f}),
      Op(ColorOpCode::kAdjust,
         {0.8f, 0.6f, 1.3f, 0.9f, 0, 7, 0.1f, 0.02f, 0.3f, 0.1f, 0.9f, 0.05f}),
      Op(ColorOpCode::kAdjust, {0.8f, 0.6f, 1.3f, 0.9f, -1, 2, 0.3f, -1, 2, -1, 2, 0}),
      recolor(2.5f, 0),
      recolor(0.5f, 0.5f),
      recolor(2.5f, 0, 0.97f, 0.03f),
      recolor(2.5f, 0.5f, 0.3f, 0.7f),
      recolor(1e6f, 0),
      gradient,
      table,
      Op(ColorOpCode::kSoftClip, {0.8f}),
      palette};
  std::vector<float> colors(3 * kColors);
  for (size_t i = 0; i < colors.size(); ++i) {
    constexpr float kEdges[] = {0, 1, 0.04045f, 1e-30f};
    colors[i] = i < 3 * 64 ? kEdges[(i / 3) >> (2 * (i % 3)) & 3]
                : i % 2    ? uniform(rng)
                           : beyond(rng);
  }
  std::vector<uint8_t> mask(kColors);
  for (uint8_t& value : mask) value = rng() % 4 ? uint8_t(rng()) : 0;
  const auto check = [&](const ColorMap& map, const char* what, int which) {
    std::vector<float> expected(colors.size()), edited = colors;
    EditColorsOneByOne(map, mask.data(), colors.data(), kColors, expected.data());
    EditColors(map, mask.data(), edited.data(), kColors, edited.data());
    double worst = 0;
    for (size_t i = 0; i < colors.size(); ++i) {
      ASSERT_TRUE(std::isfinite(edited[i])) << what << which << " value " << i;
      worst = std::max(worst, std::abs(double(edited[i]) - double(expected[i])));
      ASSERT_TRUE(mask[i / 3] != 0 || edited[i] == colors[i]) << what << which << " value " << i;
    }
    EXPECT_LE(worst, kTolerance) << what << which;
  };
  for (const ColorOp& op : ops) {
    ColorProgram program{};
    program.strength = 1;
    program.tables = tables.data();
    program.ops[program.count++] = op;
    ColorMap map{};
    map.program = &program;
    check(map, "operation ", int(&op - ops));
    program.strength = 0.3f;
    program.ops[program.count++] = ops[0];
    check(map, "a matrix after operation ", int(&op - ops));
    for (const int size : {0, kCurve}) {
      program.encodes = true;
      program.encode = Op(ColorOpCode::kEncode, {0.8f, 0.1f, 0.1f, 0, 1, 0, 0, 0.1f, 0.9f});
      program.decode = Op(ColorOpCode::kDecode, {1.2f, -0.1f, -0.1f, 0, 1, 0, 0, -0.1f, 1.1f});
      program.encode.table = program.decode.table = curve_at;
      program.encode.size = program.decode.size = size;
      check(map, size > 0 ? "on a curve, operation " : "on light, operation ", int(&op - ops));
    }
  }
  ColorMap affine{};
  for (float& value : affine.delta) value = uniform(rng);
  for (float& value : affine.offset) value = uniform(rng);
  check(affine, "affine ", 0);
}

}  // namespace
}  // namespace retint
