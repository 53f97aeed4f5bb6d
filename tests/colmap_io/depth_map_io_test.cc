// SPDX-License-Identifier: BSD-3-Clause
#include "colmap_io/depth_map_io.h"

#include <cmath>
#include <cstring>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/files.h"
#include "tests/support/data.h"

namespace retint {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

std::string FloatBytes(const std::vector<float>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float)};
}

template <typename Matcher>
void ExpectRefused(const std::string& bytes, const Matcher& message) {
  const TempFolder folder;
  WriteFile(folder / "d.bin", bytes);
  EXPECT_THAT([&] { ReadDepthMap(folder / "d.bin"); },
              ThrowsMessage<InputError>(AllOf(HasSubstr((folder / "d.bin").string()), message)));
}

TEST(DepthMapIoTest, BytesAreHeaderThenRows) {
  const TempFolder folder;
  DepthMap depth(3, 2);
  depth(0, 0) = 1;
  depth(1, 0) = 2;
  depth(2, 0) = 3;
  depth(0, 1) = 4.5f;
  WriteDepthMap(folder / "sub/a.jpg.geometric.bin", depth);
  EXPECT_EQ(ReadFile(folder / "sub/a.jpg.geometric.bin"),
            "3&2&1&" + FloatBytes({1, 2, 3, 4.5f, 0, 0}));
  const DepthMap back = ReadDepthMap(folder / "sub/a.jpg.geometric.bin");
  EXPECT_EQ(back.width, 3);
  EXPECT_EQ(back.height, 2);
  EXPECT_EQ(back.data, depth.data);
}

TEST(DepthMapIoTest, ColmapsOwnMapsRoundTrip) {
  RETINT_REQUIRE_DATA("colmap/two_views_dense/stereo/depth_maps");
  const TempFolder folder;
  int maps = 0;
  for (const auto& entry :
       std::filesystem::directory_iterator(DataPath("colmap/two_views_dense/stereo/depth_maps"))) {
    const DepthMap depth = ReadDepthMap(entry.path());
    WriteDepthMap(folder / "copy.bin", depth);
    // Photometric maps are unfiltered: a few of their depths are negative, and read as 0.
    std::string expected = ReadFile(entry.path());
    const size_t header = expected.size() - depth.data.size() * sizeof(float);
    for (size_t at = header; at < expected.size(); at += sizeof(float)) {
      if (expected[at + 3] & 0x80) std::memset(&expected[at], 0, sizeof(float));
    }
    EXPECT_TRUE(ReadFile(folder / "copy.bin") == expected) << entry.path();
    size_t known = 0;
    for (const float z : depth.data) known += z > 0;
    EXPECT_GT(known, depth.data.size() / 10) << entry.path();
    ++maps;
  }
  EXPECT_EQ(maps, 3);
}

TEST(DepthMapIoTest, NegativeDepthsAreNone) {
  const TempFolder folder;
  WriteFile(folder / "d.bin", "2&1&1&" + FloatBytes({-1, 2}));
  EXPECT_EQ(ReadDepthMap(folder / "d.bin").data, (std::vector<float>{0, 2}));
}

TEST(DepthMapIoTest, BadHeaders) {
  for (const char* header : {"", "3&", "3&2&1", "3 2 1 ", "a&b&c&", "-3&2&1&", "P6\n3 2\n255\n",
                             "99999999999999999999999&1&1&"}) {
    ExpectRefused(header, HasSubstr("is not a COLMAP depth map"));
  }
  ExpectRefused("2&1&3&" + FloatBytes({1, 2, 3, 4, 5, 6}), HasSubstr("has 3 channels"));
  ExpectRefused("0&5&1&", HasSubstr("size 0x5 is out of range"));
}

TEST(DepthMapIoTest, LengthMustBeWhatTheHeaderSays) {
  ExpectRefused("3&2&1&" + FloatBytes({1, 2, 3, 4, 5}), HasSubstr("truncated: 3x2 depths"));
  ExpectRefused("3&2&1&" + FloatBytes({1, 2, 3, 4, 5, 6, 7}), HasSubstr("28 follow the header"));
  // 4 TB by the header; nothing of that size may be taken.
  ExpectRefused("1000000&1000000&1&" + FloatBytes({1}), HasSubstr("truncated"));
  // Products that overflow.
  ExpectRefused("4294967296&4294967296&1&", HasSubstr("out of range"));
}

TEST(DepthMapIoTest, ValuesThatAreNoNumbers) {
  const float infinity = std::numeric_limits<float>::infinity();
  ExpectRefused("2&2&1&" + FloatBytes({1, 2, 3, std::nanf("")}),
                HasSubstr("depth at pixel (1, 1) is NaN"));
  ExpectRefused("2&2&1&" + FloatBytes({1, infinity, 3, 4}),
                HasSubstr("depth at pixel (1, 0) is infinite"));
}

TEST(DepthMapIoTest, MissingFile) {
  const TempFolder folder;
  EXPECT_THAT([&] { ReadDepthMap(folder / "none.bin"); },
              ThrowsMessage<InputError>(HasSubstr("No such file")));
}

}  // namespace
}  // namespace retint
