// SPDX-License-Identifier: BSD-3-Clause
// Parts of finding outlines: the graph of a picture's pixels and its cut, creases of the surface,
// and mattes.
#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "selection/mask_tools/guided_matte.h"
#include "selection/mask_tools/min_cut.h"
#include "selection/mask_tools/pixel_graph.h"
#include "selection/mask_tools/surface_edges.h"

namespace retint {
namespace {

TEST(MinCut, CutsAChainAtItsWeakestEdge) {
  // 0 - 1 - 2 - 3 with weights 3, 1 and 2.
  const EdgeMatrix chain = {
      .begin = {0, 1, 3, 5, 6}, .other = {1, 0, 2, 1, 3, 2}, .weight = {3, 3, 1, 1, 2, 2}};
  using Sides = std::vector<uint8_t>;
  EXPECT_EQ(MinCut(chain, std::vector<float>{100, 0, 0, -100}), (Sides{1, 1, 0, 0}));
  // Node 1 would rather be 0: at the second odds that is worth the stronger edge.
  EXPECT_EQ(MinCut(chain, std::vector<float>{100, -1.5f, 0, -100}), (Sides{1, 1, 0, 0}));
  EXPECT_EQ(MinCut(chain, std::vector<float>{100, -2.5f, 0, -100}), (Sides{1, 0, 0, 0}));
  EXPECT_EQ(MinCut({}, {}), Sides());
}

// Inverse depth of two planes that meet at column 40, by `turn` times 45 degrees each.
ScalarImage TwoPlanes(float turn) {
  ScalarImage inverse_depth(80, 20);
  for (int y = 0; y < 20; ++y) {
    for (int x = 0; x < 80; ++x) {
      inverse_depth(x, y) = (1 + turn * std::abs(float(x) - 40) / 100) / 3;
    }
  }
  return inverse_depth;
}

// Noise of 12x9 pixels, and seeds in a part of them.
struct SeededNoise {
  PixelArray<float, 4> features{12, 9};
  ScalarImage valleys{12, 9};
  std::vector<Seed> seeds;

  SeededNoise() {
    std::mt19937 random(3);
    for (float& value : features.data) value = 0.1f * float(random() % 1000) / 1000;
    for (size_t p = 0; p < features.NumPixels(); ++p) {
      const auto kind = random() % 6;
      seeds.push_back(kind == 0 ? Seed::kInside : kind < 3 ? Seed::kOutside : Seed::kNone);
    }
  }
};

TEST(PixelGraph, IsCutInItsFreePixelsAsAWhole) {
  const SeededNoise noise;
  const PixelGraph graph(noise.features, noise.valleys, 0.3);
  const FreePixels free = graph.Free(noise.seeds);
  const FreePixels all = graph.Free(std::vector<Seed>(noise.seeds.size(), Seed::kNone));
  ASSERT_EQ(all.pixels.size(), noise.seeds.size());
  std::vector<float> odds(noise.seeds.size(), 0);
  for (size_t p = 0; p < odds.size(); ++p) {
    if (noise.seeds[p] != Seed::kNone) odds[p] = noise.seeds[p] == Seed::kInside ? 1e4f : -1e4f;
  }
  const std::vector<uint8_t> expected = MinCut(all.edges, odds);
  const std::vector<uint8_t> sides = MinCut(free.edges, free.given);
  size_t inside = 0;
  for (size_t i = 0; i < sides.size(); ++i) {
    EXPECT_EQ(sides[i], expected[size_t(free.pixels[i])]) << free.pixels[i];
    inside += sides[i];
  }
  EXPECT_GT(inside, 5u);
  EXPECT_LT(inside, sides.size() - 5);
}

TEST(PixelGraph, MeasuresDistancesUpToOtherSeeds) {
  const PixelArray<float, 4> features(7, 1);
  const ScalarImage valleys(7, 1);
  const PixelGraph graph(features, valleys, 0.3);
  std::vector<Seed> seeds(7, Seed::kNone);
  seeds[0] = seeds[1] = Seed::kInside;
  seeds[5] = Seed::kOutside;
  const FreePixels free = graph.Free(seeds);  // 2, 3, 4 and 6
  const std::vector<float> in = free.DistancesTo(Seed::kInside);
  const std::vector<float> out = free.DistancesTo(Seed::kOutside);
  const float step = in[0];  // of a pixel's width
  EXPECT_GT(step, 0);
  EXPECT_NEAR(in[1], 2 * step, 1e-6f);
  EXPECT_NEAR(in[2], 3 * step, 1e-6f);
  EXPECT_TRUE(std::isinf(in[3]));  // behind a seed outside
  EXPECT_NEAR(out[0], 3 * step, 1e-6f);
  EXPECT_NEAR(out[3], step, 1e-6f);
}

TEST(SurfaceValleys, AreWhereSurfacesMeetAndNotWhereTheyBendAway) {
  const ScalarImage valley = SurfaceValleys(TwoPlanes(1), 100);
  EXPECT_FLOAT_EQ(valley(40, 10), 1);
  EXPECT_NEAR(valley(20, 10), 0, 1e-3);
  EXPECT_NEAR(valley(60, 10), 0, 1e-3);
  const ScalarImage ridge = SurfaceValleys(TwoPlanes(-1), 100);
  for (int x = 3; x < 77; ++x) EXPECT_NEAR(ridge(x, 10), 0, 1e-3) << x;
}

TEST(SurfaceValleys, LieBehindASilhouette) {
  ScalarImage inverse_depth(80, 20, 0.25f);
  for (int y = 0; y < 20; ++y) std::fill_n(&inverse_depth(0, y), 40, 0.5f);
  const ScalarImage valleys = SurfaceValleys(inverse_depth, 100);
  EXPECT_FLOAT_EQ(valleys(40, 10), 1);  // the wall beside an object before it
  EXPECT_EQ(valleys(39, 10), 0);
  EXPECT_EQ(valleys(60, 10), 0);
}

TEST(SurfaceValleys, AreJudgedAgainstTheNoiseOfThePicture) {
  ScalarImage noisy = TwoPlanes(0);
  std::mt19937 random(3);
  for (float& value : noisy.data) value *= 1 + 0.05f * (float(random() >> 8) * 0x1p-24f - 0.5f);
  const ScalarImage valleys = SurfaceValleys(noisy, 100);
  const double sum = std::accumulate(valleys.data.begin(), valleys.data.end(), 0.0);
  EXPECT_LT(sum / double(valleys.NumPixels()), 0.05);
}

Mask All(int width, int height) { return Mask(width, height, 255); }

TEST(GuidedMattes, AreSoftWhereTheGuideIs) {
  // A ramp from column 20 to 40 in the guide; the values jump at its middle.
  PixelArray<float, 4> guide(60, 30);
  ScalarImage values(60, 30);
  for (int y = 0; y < 30; ++y) {
    for (int x = 0; x < 60; ++x) {
      guide(x, y) = std::clamp((float(x) - 20) / 20, 0.0f, 1.0f);
      values(x, y) = x >= 30 ? 1 : 0;
    }
  }
  const ScalarImage matte = GuidedMattes({&values, 1}, guide, guide, All(60, 30), 12).front();
  for (int x = 25; x < 35; ++x) {
    // A line fitted to a step over a whole ramp is half again as steep as the ramp: at its quarter
    // that is 0.125 off.
    EXPECT_NEAR(matte(x, 15), guide(x, 15), 0.2) << x;
    EXPECT_GT(matte(x, 15), matte(x - 1, 15)) << x;
  }
  EXPECT_LT(matte(5, 15), 0.05);
  EXPECT_GT(matte(55, 15), 0.95);
}

TEST(GuidedMattes, FindEdgesOfALargerGuide) {
  PixelArray<float, 4> guide(80, 80);
  for (int y = 0; y < 80; ++y) {
    for (int x = 0; x < 80; ++x) guide(x, y) = x >= 43 ? 1 : 0;
  }
  ScalarImage values(20, 20);  // at a quarter of the size the edge is at 43 / 4 = 10.75
  for (int y = 0; y < 20; ++y) {
    for (int x = 0; x < 20; ++x) values(x, y) = x >= 11 ? 1 : 0;
  }
  const ScalarImage matte =
      GuidedMattes({&values, 1}, Resized(guide, 20, 20), guide, All(80, 80), 2).front();
  ASSERT_EQ(matte.width, 80);
  EXPECT_LT(matte(42, 40), 0.5);
  EXPECT_GT(matte(43, 40), 0.5);
}

}  // namespace
}  // namespace retint
