// SPDX-License-Identifier: BSD-3-Clause
// Files that other people's programs wrote.
#include <algorithm>
#include <cctype>
#include <span>

#include <gmock/gmock.h>

#include "splat_io/splat_io.h"
#include "tests/splat_io/ply_text.h"
#include "tests/splat_io/random_scene.h"

namespace retint {
namespace {

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

// The same three Gaussians as another program converted them. Its .spz is right-up-back, as the
// format wants it.
TEST(SplatIoTest, AgreesWithAnotherProgramsConversions) {
  RETINT_REQUIRE_DATA("splats/test-splat.3-points-from-train.splat");
  const std::string name = "splats/test-splat.3-points-from-train";
  const GaussianModel ply = ReadSplat(DataPath(name + ".ply"));
  const GaussianModel splat = ReadSplat(DataPath(name + ".splat"));
  EXPECT_EQ(splat.sh_degree, 0);
  // Positions are floats in both; scales went through two programs' expf; bytes are off by one
  // step, since rounding and truncation both occur, rotations of 1/128.
  ExpectNear(ply, splat, {0, 2e-6, 1.0 / 255, 1.0 / 255, 0, 2.0 / 128});
  const GaussianModel spz = ReadSplat(DataPath(name + ".spz"));
  EXPECT_EQ(spz.sh_degree, 3);
  // Steps of 1/4096, 1/16, 1/255, 0.0074 in color, 16/128, and sqrt(1/2)/511, half of each and 1 %.
  ExpectNear(ply, spz,
             {0.505 / 4096, 0.505 / 16, 0.505 / 255, 0.505 * 0.0074, 0.505 * 17 / 128,
              3 * 0.505 * 0.7072 / 511});
}

// One scene that another program wrote twice, in other orders: compares boxes and means.
TEST(SplatIoTest, TwoFormatsOfOneSceneAgree) {
  RETINT_REQUIRE_DATA("splats/biker.spz");
  const GaussianModel ply = ReadSplat(DataPath("splats/biker.compressed.ply"));
  const GaussianModel spz = ReadSplat(DataPath("splats/biker.spz"));
  ASSERT_EQ(ply.NumGaussians(), 152746u);
  ASSERT_EQ(spz.NumGaussians(), 152746u);
  EXPECT_EQ(ply.sh_degree, 0);
  EXPECT_EQ(spz.sh_degree, 0);
  const auto mean = [](std::span<const float> values, size_t width, size_t i) {
    double sum = 0;
    for (size_t g = 0; g < values.size() / width; ++g) sum += values[g * width + i];
    return sum / double(values.size() / width);
  };
  for (size_t i = 0; i < 3; ++i) {
    // Errors of rounding average out; a turned axis would be off by its extent, 1 to 3.
    EXPECT_NEAR(mean(ply.means, 3, i), mean(spz.means, 3, i), 1e-4);
    EXPECT_NEAR(mean(ply.sh, 3, i), mean(spz.sh, 3, i), 2e-3);
  }
}

struct PackedFile {
  const char* path;
  size_t gaussians;
  int sh_degree;
  const char* extension;  // to write again; nullptr: cannot
};

void PrintTo(const PackedFile& file, std::ostream* out) { *out << file.path; }

class PackedFileTest : public ::testing::TestWithParam<PackedFile> {};

// A second write has the same unpacked bytes, so reading it gives the same.
TEST_P(PackedFileTest, IsReadAndWrittenAgain) {
  const PackedFile& file = GetParam();
  RETINT_REQUIRE_DATA(file.path);
  const TempFolder folder;
  const GaussianModel model = ReadSplat(DataPath(file.path));
  EXPECT_EQ(model.NumGaussians(), file.gaussians);
  EXPECT_EQ(model.sh_degree, file.sh_degree);
  EXPECT_NO_THROW(model.Validate());
  if (!file.extension) return;
  WriteSplat(folder / (std::string("out") + file.extension), model);
  const GaussianModel back = ReadSplat(folder / (std::string("out") + file.extension));
  EXPECT_TRUE(back.source.packed == model.source.packed);
  EXPECT_TRUE(back.sh == model.sh);
}

INSTANTIATE_TEST_SUITE_P(
    Files, PackedFileTest,
    ::testing::Values(PackedFile{"splats/biker.compressed.ply", 152746, 0, ".compressed.ply"},
                      PackedFile{"splats/biker.spz", 152746, 0, ".spz"},
                      PackedFile{"splats/angel.sog", 71359, 0, ".sog"},
                      PackedFile{"splats/minimal.ksplat", 4, 0, nullptr},
                      PackedFile{"splats/minimal-raw.spz", 4, 0, ".spz"},
                      PackedFile{"splats/minimal-v2.spz", 4, 0, ".spz"},
                      PackedFile{"splats/minimal-v3.spz", 4, 0, ".spz"},
                      PackedFile{"splats/minimal-v4.spz", 4, 0, ".spz"},
                      PackedFile{"splats/minimal.splat", 4, 0, ".splat"},
                      PackedFile{"splats/test-splat.3-points-from-train.splat", 3, 0, ".splat"},
                      PackedFile{"splats/test-splat.3-points-from-train.spz", 3, 3, ".spz"}),
    [](const auto& test) {
      std::string name = std::filesystem::path(test.param.path).filename();
      std::replace_if(
          name.begin(), name.end(), [](char c) { return !std::isalnum(c); }, '_');
      return name;
    });

}  // namespace
}  // namespace retint
