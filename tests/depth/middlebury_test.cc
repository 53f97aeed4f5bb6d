// SPDX-License-Identifier: BSD-3-Clause
// Matchers on photographs of known disparity (Middlebury 2014, Motorcycle).
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <zlib.h>

#include "base/files.h"
#include "base/median.h"
#include "colmap_io/image_io.h"
#include "depth/network_matcher.h"
#include "depth/stereo_pairs.h"
#include "tests/support/data.h"

namespace retint {
namespace {

// The first member of a .npz, a deflated .npy of floats.
std::vector<float> ReadNpz(const std::filesystem::path& path) {
  const std::string file = ReadFile(path);
  ByteReader reader(file, path);
  reader.ReadBytes(18, "zip header");
  const auto packed = reader.Read<uint32_t>("packed size");
  const auto unpacked = reader.Read<uint32_t>("size");
  const auto name = reader.Read<uint16_t>("name length");
  const auto extra = reader.Read<uint16_t>("extra length");
  reader.ReadBytes(size_t(name) + extra, "name");
  const auto bytes = reader.ReadBytes(packed, "data");
  std::string npy(unpacked, 0);
  z_stream stream{};
  inflateInit2(&stream, -MAX_WBITS);
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = packed;
  stream.next_out = reinterpret_cast<Bytef*>(npy.data());
  stream.avail_out = unpacked;
  EXPECT_EQ(inflate(&stream, Z_FINISH), Z_STREAM_END);
  inflateEnd(&stream);
  uint16_t header = 0;
  std::memcpy(&header, npy.data() + 8, 2);
  std::vector<float> values((npy.size() - 10 - header) / sizeof(float));
  std::memcpy(values.data(), npy.data() + 10 + header, values.size() * sizeof(float));
  return values;
}

// Of the pixels whose disparity is known, where both directions agree within a pixel.
struct Figures {
  double measured, off;  // fractions: of the known, and of the measured that miss it by 2 pixels
  double median, mean;   // errors, pixels
};

void Measure(const StereoMatcher& matcher, Figures* figures) {
  const std::vector<float> truth = ReadNpz(DataPath("stereo/motorcycle_disp.npz"));
  RenderedPair pair{Shift::kRight,
                    {},
                    ReadImage8(DataPath("stereo/motorcycle_left.png")),
                    ReadImage8(DataPath("stereo/motorcycle_right.png"))};
  const int width = pair.reference.width, height = pair.reference.height;
  pair.rect = {0, 0, width, height};
  ASSERT_EQ(truth.size(), pair.reference.NumPixels());
  const ScalarImage found =
      MatchPair(matcher, pair, width, height, {0, 80}, /*tolerance=*/1, Monitor());
  std::vector<float> errors;
  double known = 0, bad = 0, sum = 0;
  for (size_t i = 0; i < truth.size(); ++i) {
    if (!std::isfinite(truth[i]) || truth[i] <= 0) continue;
    ++known;
    if (found.data[i] < 0) continue;
    errors.push_back(std::abs(found.data[i] - truth[i]));
    sum += errors.back();
    bad += errors.back() > 2;
  }
  ASSERT_GT(known, 300000);
  ASSERT_FALSE(errors.empty());
  const auto count = double(errors.size());
  *figures = {count / known, bad / count, Median(errors), sum / count};
  std::printf("measured %.1f %%, mean error %.2f pixels, off by more than 2 pixels %.1f %%\n",
              100 * figures->measured, figures->mean, 100 * figures->off);
}

TEST(Middlebury, SgbmFindsMotorcyclesDisparities) {
  RETINT_REQUIRE_DATA("stereo/motorcycle_disp.npz");
  Figures found{};
  Measure(*MakeSgbmMatcher(), &found);
  // Measured 0.83, 0.17 pixels and 5 %; a matcher that lost its way is far off these.
  EXPECT_GT(found.measured, 0.8);
  EXPECT_LT(found.median, 0.25);
  EXPECT_LT(found.off, 0.09);
}

TEST(Middlebury, YourNetworkFindsThemToo) {
  RETINT_REQUIRE_DATA("stereo/motorcycle_disp.npz");
  const char* const name = std::getenv("RETINT_MATCHER");
  if (!name) GTEST_SKIP() << "RETINT_MATCHER names no network";
  Figures found{};
  Measure(*MakeNetworkMatcher(name), &found);
  EXPECT_GT(found.measured, 0.5);
  EXPECT_LT(found.off, 0.09) << "as for sgbm";
}

}  // namespace
}  // namespace retint
