// SPDX-License-Identifier: BSD-3-Clause
// Files that other people's programs wrote.
#include <cmath>
#include <map>

#include <gmock/gmock.h>

#include "splat_io/splat_io.h"
#include "tests/splat_io/ply_text.h"

namespace retint {
namespace {

using ::testing::HasSubstr;

struct RealFile {
  const char* path;
  size_t gaussians;
};

void PrintTo(const RealFile& file, std::ostream* out) { *out << file.path; }

class RealFileTest : public ::testing::TestWithParam<RealFile> {};

TEST_P(RealFileTest, ReadThenWrittenHasTheSameBytes) {
  RETINT_REQUIRE_DATA(GetParam().path);
  const TempFolder folder;
  const GaussianModel model = ReadSplat(DataPath(GetParam().path));
  EXPECT_EQ(model.NumGaussians(), GetParam().gaussians);
  EXPECT_EQ(model.sh_degree, 3);
  EXPECT_NO_THROW(model.Validate());
  WriteSplat(folder / "out.ply", model);
  EXPECT_TRUE(ReadFile(folder / "out.ply") == ReadFile(DataPath(GetParam().path)));
}

INSTANTIATE_TEST_SUITE_P(
    Files, RealFileTest,
    ::testing::Values(RealFile{"fox/splat.ply", 117895}, RealFile{"flower/splat.ply", 92029},
                      RealFile{"splats/cup.ply", 9080},
                      RealFile{"splats/test-splat.3-points-from-train.ply", 3}),
    [](const auto& test) { return "n" + std::to_string(test.param.gaussians); });

// The same three Gaussians as another program converted them to .splat: 32 bytes each, position and
// linear scale as floats, colour and opacity as bytes, wxyz as bytes about 128.
TEST(SplatIoTest, AgreesWithAnotherProgramsConversion) {
  RETINT_REQUIRE_DATA("splats/test-splat.3-points-from-train.splat");
  const GaussianModel model = ReadSplat(DataPath("splats/test-splat.3-points-from-train.ply"));
  const std::string other = ReadFile(DataPath("splats/test-splat.3-points-from-train.splat"));
  ASSERT_EQ(other.size(), model.NumGaussians() * 32);
  ByteReader reader(other, "splat");
  for (size_t g = 0; g < model.NumGaussians(); ++g) {
    for (size_t i = 0; i < 3; ++i) EXPECT_EQ(reader.Read<float>("x"), model.means[g * 3 + i]);
    for (size_t i = 0; i < 3; ++i) {
      // Two programs' expf: a few units in the last place.
      EXPECT_FLOAT_EQ(reader.Read<float>("scale"), std::exp(model.log_scales[g * 3 + i]));
    }
    for (size_t c = 0; c < 3; ++c) {
      // One step of the byte: rounding and truncation both occur.
      const double color = 255 * (0.5 + 0.28209479177387814 * double(model.sh[g * 48 + c]));
      EXPECT_NEAR(reader.Read<uint8_t>("color"), std::clamp(color, 0.0, 255.0), 1);
    }
    const double opacity = 255 / (1 + std::exp(-double(model.opacity_logits[g])));
    EXPECT_NEAR(reader.Read<uint8_t>("opacity"), opacity, 1);
    const float* q = &model.quats_wxyz[g * 4];
    const double norm = std::sqrt(double(q[0]) * q[0] + double(q[1]) * q[1] + double(q[2]) * q[2] +
                                  double(q[3]) * q[3]);
    for (size_t i = 0; i < 4; ++i) {
      EXPECT_NEAR(reader.Read<uint8_t>("rotation"), 128 + 128 * q[i] / norm, 1);
    }
  }
}

TEST(SplatIoTest, EveryFileIsReadOrRefusedByItsFormatsName) {
  RETINT_REQUIRE_DATA("splats");
  const std::map<std::string, std::string> refusals = {
      {"angel.sog", "this is SOG, not supported"},
      {"biker.compressed.ply", "this is a compressed .ply (PlayCanvas), not supported"},
      {"biker.spz", "this is SPZ, not supported"},
      {"minimal-raw.spz", "this is SPZ, not supported"},
      {"minimal-v2.spz", "this is SPZ (gzip), not supported"},
      {"minimal-v3.spz", "this is SPZ (gzip), not supported"},
      {"minimal-v4.spz", "this is SPZ, not supported"},
      {"minimal.ksplat", "this is .ksplat (GaussianSplats3D), not supported"},
      {"minimal.splat", "this is .splat (antimatter15), not supported"},
      {"test-splat.3-points-from-train.splat", "this is .splat (antimatter15), not supported"},
      {"test-splat.3-points-from-train.spz", "this is SPZ (gzip), not supported"}};
  int refused = 0;
  for (const auto& entry : std::filesystem::directory_iterator(DataPath("splats"))) {
    const auto found = refusals.find(entry.path().filename().string());
    if (found == refusals.end()) {
      EXPECT_GT(ReadSplat(entry.path()).NumGaussians(), 0u) << entry.path();
      continue;
    }
    ++refused;
    const std::string message = MessageOf<InputError>([&] { ReadSplat(entry.path()); });
    EXPECT_THAT(message, HasSubstr(found->first + ": " + found->second));
    EXPECT_THAT(message, HasSubstr("supported: 3DGS .ply (binary little-endian)"));
  }
  EXPECT_EQ(refused, 11);
}

}  // namespace
}  // namespace retint
