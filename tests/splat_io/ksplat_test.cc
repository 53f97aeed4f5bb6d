// SPDX-License-Identifier: BSD-3-Clause
// .ksplat, put together value by value, apart from the codec that it tests.
#include <cmath>

#include <gmock/gmock.h>

#include "splat_io/splat_io.h"
#include "tests/splat_io/ply_text.h"

namespace retint {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

template <typename T>
void Put(std::string& bytes, size_t at, T value) {
  bytes.replace(at, sizeof(T), PlyText::Raw(value));
}

std::string Header(uint32_t sections, uint32_t count, uint16_t level) {
  std::string header(4096 + 1024 * sections, '\0');
  header[1] = 1;
  Put(header, 4, sections);
  Put(header, 8, sections);
  Put(header, 12, count);
  Put(header, 16, count);
  Put(header, 20, level);
  return header;
}

constexpr uint16_t kHalfOne = 0x3C00, kHalfTwo = 0x4000, kHalfMinusQuarter = 0xB400;

// Level 0, SH degree 1: one Gaussian, position (1, 2, 3), scales e^0 to e^2.
std::string Level0() {
  std::string file = Header(1, 1, 0);
  Put(file, 4096, uint32_t{1});
  Put(file, 4096 + 4, uint32_t{1});
  Put(file, 4096 + 40, uint16_t{1});
  for (const float x :
       {1.0f, 2.0f, 3.0f, 1.0f, std::exp(1.0f), std::exp(2.0f), 0.5f, -0.5f, 0.5f, 0.5f}) {
    file += PlyText::Raw(x);
  }
  file += std::string("\xFF\x00\x80\x33", 4);
  // Red's three coefficients, then green's, then blue's.
  for (int i = 0; i < 9; ++i) file += PlyText::Raw(static_cast<float>(i) / 8);
  return file;
}

// Level 1 or 2: three Gaussians in two buckets of room for 2, the second one partly filled.
std::string Buckets(uint16_t level) {
  std::string file = Header(1, 3, level);
  Put(file, 4096, uint32_t{3});
  Put(file, 4096 + 4, uint32_t{3});
  Put(file, 4096 + 8, uint32_t{2});   // of a bucket
  Put(file, 4096 + 12, uint32_t{2});  // buckets
  Put(file, 4096 + 16, 5.0f);         // their size
  Put(file, 4096 + 20, uint16_t{12});
  Put(file, 4096 + 24, uint32_t{32767});
  Put(file, 4096 + 32, uint32_t{1});
  Put(file, 4096 + 36, uint32_t{1});
  Put(file, 4096 + 40, static_cast<uint16_t>(level == 2));
  file += PlyText::Raw(uint32_t{1});
  for (const float center : {10.0f, 20.0f, 30.0f, -10.0f, -20.0f, -30.0f}) {
    file += PlyText::Raw(center);
  }
  for (int g = 0; g < 3; ++g) {
    for (const uint16_t x : {uint16_t{32767}, uint16_t{0}, uint16_t{65534}, kHalfOne, kHalfTwo,
                             kHalfOne, kHalfOne, kHalfMinusQuarter, uint16_t{0}, uint16_t{1}}) {
      file += PlyText::Raw(x);
    }
    file += std::string("\xFF\x00\x80\x33", 4);
    if (level == 2) file += std::string("\x00\xFF\x33\x00\x00\x00\x00\x00\x00", 9);
  }
  return file;
}

class KsplatTest : public ::testing::Test {
 protected:
  GaussianModel Read(const std::string& bytes) {
    SpillFile(folder_ / "a.ksplat", bytes);
    return ReadSplat(folder_ / "a.ksplat");
  }
  std::string Refusal(const std::string& bytes) {
    const std::string message = MessageOf<InputError>([&] { Read(bytes); });
    EXPECT_THAT(message,
                AllOf(HasSubstr((folder_ / "a.ksplat").string() + ":"), Not(HasSubstr("\n"))));
    return message;
  }
  TempFolder folder_;
};

TEST_F(KsplatTest, FloatsAreRead) {
  const GaussianModel model = Read(Level0());
  ASSERT_EQ(model.sh_degree, 1);
  EXPECT_THAT(model.means, ElementsAre(1, 2, 3));
  for (size_t i = 0; i < 3; ++i) EXPECT_NEAR(model.log_scales[i], i, 1e-6);
  EXPECT_THAT(model.quats_wxyz, ElementsAre(0.5f, -0.5f, 0.5f, 0.5f));
  EXPECT_NEAR(0.5 + 0.28209479 * model.sh[0], 1, 1e-6);
  EXPECT_NEAR(0.5 + 0.28209479 * model.sh[1], 0, 1e-6);
  EXPECT_NEAR(1 / (1 + std::exp(-double(model.opacity_logits[0]))), 0x33 / 255.0, 1e-6);
  const std::vector<float> bands(model.sh.begin() + 3, model.sh.end());
  EXPECT_THAT(bands, ElementsAre(0, 3 / 8.0f, 6 / 8.0f, 1 / 8.0f, 4 / 8.0f, 7 / 8.0f, 2 / 8.0f,
                                 5 / 8.0f, 1.0f));
}

TEST_F(KsplatTest, BucketsAndHalvesAreRead) {
  for (const uint16_t level : {uint16_t{1}, uint16_t{2}}) {
    const GaussianModel model = Read(Buckets(level));
    ASSERT_EQ(model.NumGaussians(), 3u);
    // Steps of 2.5 / 32767 about the bucket's middle; the third Gaussian is in the second bucket.
    const float expected[] = {10, 17.5, 32.5, 10, 17.5, 32.5, -10, -22.5, -27.5};
    for (size_t i = 0; i < 9; ++i) EXPECT_NEAR(model.means[i], expected[i], 1e-4) << i;
    EXPECT_NEAR(model.log_scales[1], std::log(2), 1e-6);
    EXPECT_THAT(std::vector<float>(model.quats_wxyz.begin(), model.quats_wxyz.begin() + 4),
                ElementsAre(1, -0.25f, 0, std::ldexp(1.0f, -24)));
    EXPECT_EQ(model.sh_degree, level == 2 ? 1 : 0);
    if (level < 2) continue;
    EXPECT_FLOAT_EQ(model.sh[3], -1.5f);             // red of the first coefficient
    EXPECT_FLOAT_EQ(model.sh[6], 1.5f);              // of the second
    EXPECT_FLOAT_EQ(model.sh[9], -1.5f + 3 * 0.2f);  // of the third
  }
}

TEST_F(KsplatTest, AnotherProgramsFileIsRead) {
  RETINT_REQUIRE_DATA("splats/minimal.ksplat");
  const GaussianModel model = ReadSplat(DataPath("splats/minimal.ksplat"));
  // The same four as in minimal.splat.
  const GaussianModel splat = ReadSplat(DataPath("splats/minimal.splat"));
  EXPECT_EQ(model.means, splat.means);
  EXPECT_EQ(model.log_scales, splat.log_scales);
  EXPECT_EQ(model.sh, splat.sh);
}

TEST_F(KsplatTest, FaultsAreNamed) {
  const auto with = [&](const std::string& file, size_t at, auto value) {
    std::string bytes = file;
    Put(bytes, at, value);
    return Refusal(bytes);
  };
  const std::string floats = Level0(), buckets = Buckets(1);
  EXPECT_THAT(with(floats, 0, uint8_t{1}), HasSubstr("version 1.1 of .ksplat"));
  EXPECT_THAT(with(floats, 4, uint32_t{4000000000}), HasSubstr("announces 4000000000 sections"));
  EXPECT_THAT(with(floats, 16, uint32_t{0}), HasSubstr("no Gaussians"));
  EXPECT_THAT(with(floats, 16, uint32_t{2}), HasSubstr("the sections hold 1 Gaussians"));
  EXPECT_THAT(with(floats, 20, uint16_t{3}), HasSubstr("compression level 3"));
  EXPECT_THAT(with(floats, 4096, uint32_t{2}), HasSubstr("more Gaussians than it has room"));
  EXPECT_THAT(with(floats, 4096 + 4, uint32_t{4294967295}), HasSubstr("truncated: section 0"));
  EXPECT_THAT(with(floats, 4096 + 40, uint16_t{9}), HasSubstr("section 0: SH degree 9"));
  EXPECT_THAT(with(floats, 5120 + 4, NAN), HasSubstr("Gaussian 0: mean is NaN"));
  EXPECT_THAT(with(floats, 5120 + 12, -1.0f), HasSubstr("Gaussian 0: scale is NaN"));
  EXPECT_THAT(with(buckets, 4096 + 36, uint32_t{0}), HasSubstr("in no bucket"));
  EXPECT_THAT(with(buckets, 4096 + 32, uint32_t{9}), HasSubstr("fewer buckets than it uses"));
  EXPECT_THAT(with(buckets, 5120, uint32_t{0}), HasSubstr("in no bucket"));
}

TEST_F(KsplatTest, EveryTruncationIsRefused) {
  for (const std::string& good : {Level0(), Buckets(1), Buckets(2)}) {
    for (size_t length = 5100; length < good.size(); ++length) {
      SCOPED_TRACE(length);
      Refusal(good.substr(0, length));
    }
    for (const size_t length : {0u, 1u, 4095u, 4096u, 5000u}) Refusal(good.substr(0, length));
  }
}

TEST_F(KsplatTest, DamagedBytesNeverCrash) {
  const std::string good = Buckets(2);
  std::mt19937 random(1);
  for (int i = 0; i < 1500; ++i) {
    std::string bytes = good;
    // The headers' first bytes and the sections, not the zeros between.
    const size_t ranges[][2] = {{0, 44}, {4096, 44}, {5120, good.size() - 5120}};
    for (int flips = 1 + i % 3; flips > 0; --flips) {
      const auto& range = ranges[random() % 3];
      bytes[range[0] + random() % range[1]] = static_cast<char>(random());
    }
    try {
      const GaussianModel model = Read(bytes);
      EXPECT_NO_THROW(model.Validate());
    } catch (const InputError& error) {
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    }
  }
}

}  // namespace
}  // namespace retint
