// SPDX-License-Identifier: BSD-3-Clause
// The matcher on photographs of known disparity (Middlebury 2014, Motorcycle).
#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <zlib.h>

#include "base/files.h"
#include "colmap_io/image_io.h"
#include "depth/stereo_matcher.h"
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

TEST(Middlebury, SgbmFindsMotorcyclesDisparities) {
  RETINT_REQUIRE_DATA("stereo/motorcycle_disp.npz");
  const Image8 left = ReadImage8(DataPath("stereo/motorcycle_left.png"));
  const Image8 right = ReadImage8(DataPath("stereo/motorcycle_right.png"));
  const std::vector<float> truth = ReadNpz(DataPath("stereo/motorcycle_disp.npz"));
  ASSERT_EQ(truth.size(), left.NumPixels());
  const ScalarImage found = MakeSgbmMatcher()->Match(left, right, {0, 80}, Monitor()).disparity;
  std::vector<double> errors;
  size_t known = 0, bad = 0;
  for (size_t i = 0; i < truth.size(); ++i) {
    if (!std::isfinite(truth[i]) || truth[i] <= 0) continue;
    ++known;
    if (found.data[i] < 0) continue;
    errors.push_back(std::abs(found.data[i] - truth[i]));
    bad += errors.back() > 2;
  }
  ASSERT_GT(known, 300000u);
  ASSERT_FALSE(errors.empty());
  std::nth_element(errors.begin(), errors.begin() + std::ptrdiff_t(errors.size() / 2),
                   errors.end());
  // Measured 0.85, 0.17 pixels and 6 %; a matcher that lost its way is far off these.
  EXPECT_GT(double(errors.size()) / double(known), 0.8);
  EXPECT_LT(errors[errors.size() / 2], 0.25);
  EXPECT_LT(double(bad) / double(errors.size()), 0.09);
}

}  // namespace
}  // namespace retint
