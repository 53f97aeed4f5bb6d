// SPDX-License-Identifier: BSD-3-Clause
#include "splat_io/row_vectors.h"

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace retint {
namespace {

TEST(RowVectorsTest, LogarithmsAreThoseOfTheLibrary) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> exponent(-87, 88);
  for (const size_t count : {size_t{0}, size_t{1}, size_t{7}, size_t{16}, size_t{1000}}) {
    std::vector<float> scales(count);
    for (float& scale : scales) scale = std::exp(exponent(random));
    std::vector<float> logs = scales;
    LogScales(logs.data(), count);
    for (size_t i = 0; i < count; ++i) {
      EXPECT_NEAR(logs[i], std::log(scales[i]), 4e-7 * std::max(1.0f, std::abs(logs[i])))
          << scales[i];
    }
  }
}

TEST(RowVectorsTest, WhatHasNoLogarithmIsNotFinite) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  float scales[] = {0, -0.0f, 1e-40f, -1, kInfinity, -kInfinity, NAN, 1};
  LogScales(scales, std::size(scales));
  EXPECT_NEAR(scales[0], LogScale(0), 1e-4);
  EXPECT_NEAR(scales[1], LogScale(0), 1e-4);
  EXPECT_NEAR(scales[2], std::log(1e-40f), 1e-4);
  EXPECT_TRUE(std::isnan(scales[3]));
  EXPECT_EQ(scales[4], kInfinity);
  EXPECT_TRUE(std::isnan(scales[5]));
  EXPECT_TRUE(std::isnan(scales[6]));
  EXPECT_EQ(scales[7], 0);
}

// Vertices of random bits, each unpacked among others and alone.
TEST(RowVectorsTest, AVertexHasTheSameBitsAmongOthersAndAlone) {
  constexpr size_t kCount = 45;
  std::mt19937 random(2);
  std::vector<uint32_t> words(4 * kCount);
  for (uint32_t& word : words) word = static_cast<uint32_t>(random());
  ChunkBounds bounds;
  for (size_t i = 0; i < bounds.size(); ++i) {
    bounds[i] = (i / 3 % 2 == 0 ? -1.7f : 2.3f) - float(i % 3) * 0.1f;
  }
  const auto* vertices = reinterpret_cast<const char*>(words.data());
  GaussianModel all;
  all.Resize(kCount, 1);
  UnpackVertices(vertices, kCount, bounds, RowPlaces(all, 0), 12);
  for (size_t g = 0; g < kCount; ++g) {
    SplatRow one;
    UnpackVertices(vertices + 16 * g, 1, bounds, RowPlaces(one), 48);
    const SplatRow row = GetRow(all, g);
    EXPECT_EQ(row.mean, one.mean);
    EXPECT_EQ(row.quat_wxyz, one.quat_wxyz);
    EXPECT_EQ(row.log_scale, one.log_scale);
    EXPECT_EQ(row.opacity_logit, one.opacity_logit);
    EXPECT_EQ(row.sh, one.sh);  // the band above the first three values is left alone
  }
}

TEST(RowVectorsTest, VerticesAreUnpackedAsTheFormatSays) {
  // Each component of a rotation is the largest in turn; bounds of 0 and 1 show the bits' shares.
  for (uint32_t largest = 0; largest < 4; ++largest) {
    const uint32_t words[] = {
        2047u << 21 | 0u << 11 | 1024u, largest << 30 | 1023u << 20 | 0u << 10 | 700u,
        0u << 21 | 1023u << 11 | 2047u, 255u << 24 | 51u << 16 | 0u << 8 | 128u};
    const ChunkBounds bounds = {0, 0, 0, 1, 1, 1, 2, 2, 2, 3, 3, 3, 0, 0, 0, 1, 1, 1};
    SplatRow row;
    UnpackVertices(reinterpret_cast<const char*>(words), 1, bounds, RowPlaces(row), 48);
    EXPECT_EQ(row.mean, (std::array<float, 3>{1, 0, 1024.0f / 2047}));
    EXPECT_EQ(row.log_scale, (std::array<float, 3>{2, 3, 3}));
    EXPECT_FLOAT_EQ(row.sh[0], 0.5f / kShC0);
    EXPECT_FLOAT_EQ(row.sh[1], (0.2f - 0.5f) / kShC0);
    EXPECT_FLOAT_EQ(row.sh[2], -0.5f / kShC0);
    EXPECT_EQ(row.opacity_logit, LogitOfByte(128));
    SmallestThree packed;
    packed.largest = static_cast<int>(largest);
    packed.rest = {0.5 * std::sqrt(2.0), -0.5 * std::sqrt(2.0),
                   (700.0 / 1023 - 0.5) * std::sqrt(2.0)};
    const std::array<double, 4> expected = UnpackSmallestThree(packed);
    for (size_t i = 0; i < 4; ++i) EXPECT_NEAR(row.quat_wxyz[i], expected[i], 1e-7) << largest;
  }
}

TEST(RowVectorsTest, BytesOfDegree3AreTurnedFromChannelsToCoefficients) {
  for (const size_t count : {size_t{1}, size_t{2}, size_t{9}}) {
    std::mt19937 random(3);
    std::vector<char> bytes(45 * count);
    for (char& byte : bytes) byte = static_cast<char>(random());
    bytes[0] = 0, bytes[44] = static_cast<char>(255);
    std::vector<float> sh(48 * count, 9);
    UnpackShOfDegree3(bytes.data(), count, sh.data());
    for (size_t g = 0; g < count; ++g) {
      for (size_t c = 0; c < 3; ++c) {
        EXPECT_EQ(sh[48 * g + c], 9);
        for (size_t k = 0; k < 15; ++k) {
          const int byte = static_cast<uint8_t>(bytes[45 * g + 15 * c + k]);
          const float value = byte == 0     ? -4.0f
                              : byte == 255 ? 4.0f
                                            : (float(byte) + 0.5f) / 32 - 4;
          EXPECT_EQ(sh[48 * g + 3 * (k + 1) + c], value) << g << ' ' << k << ' ' << c;
        }
      }
    }
  }
}

}  // namespace
}  // namespace retint
