// SPDX-License-Identifier: BSD-3-Clause
// Spherical harmonics of degree 4: kept by the formats that have them, dropped with a sentence by
// the others.
#include <gmock/gmock.h>

#include "scene/rigid3d.h"
#include "scene/sh_band4.h"
#include "scene/transform.h"
#include "splat_io/splat_io.h"
#include "tests/splat_io/ply_text.h"
#include "tests/splat_io/random_scene.h"

namespace retint {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

// With degree 4: value i of Gaussian g is (g + i) / 100.
GaussianModel Scene(size_t count) {
  GaussianModel model = RandomScene(count, 3);
  ShBand4Columns::AddTo(model);
  ShBand4Columns band4(model);
  for (size_t g = 0; g < count; ++g) {
    ShBand4 values;
    for (size_t i = 0; i < values.size(); ++i) values[i] = static_cast<float>(g + i) / 100;
    band4.Set(g, values);
  }
  return model;
}

TEST(ShDegree4, APlyKeepsEveryBit) {
  TempFolder folder;
  const GaussianModel before = Scene(40);
  WriteSplat(folder / "a.ply", before);
  EXPECT_THAT(ReadFile(folder / "a.ply"), HasSubstr("property float f_rest_71\n"));
  GaussianModel after = ReadSplat(folder / "a.ply");
  EXPECT_EQ(after.sh_degree, 3);
  EXPECT_TRUE(HasShBand4(after));
  EXPECT_EQ(after.sh, before.sh);
  const ShBand4Columns band4(after);
  ASSERT_TRUE(band4.present());
  EXPECT_EQ(band4.Get(7)[20], 0.27f);
  WriteSplat(folder / "b.ply", after);
  EXPECT_EQ(ReadFile(folder / "a.ply"), ReadFile(folder / "b.ply"));
}

// The columns of a channel follow one another, those of degree 4 last of each.
TEST(ShDegree4, ThePlysColumnsAreByChannel) {
  TempFolder folder;
  const GaussianModel scene = Scene(1);
  WriteSplat(folder / "a.ply", scene);
  const std::string bytes = ReadFile(folder / "a.ply");
  const size_t body = bytes.find("end_header\n") + 11;
  const auto column = [&](size_t i) {
    float value;
    std::memcpy(&value, bytes.data() + body + 4 * i, 4);
    return value;
  };
  const size_t rest = 9;  // x y z nx ny nz f_dc_0 f_dc_1 f_dc_2
  for (size_t c = 0; c < 3; ++c) {
    EXPECT_EQ(column(rest + 24 * c), scene.sh[3 + c]);
    EXPECT_EQ(column(rest + 24 * c + 14), scene.sh[45 + c]);
    for (size_t k = 0; k < 9; ++k) {
      EXPECT_EQ(column(rest + 24 * c + 15 + k), static_cast<float>(3 * k + c) / 100);
    }
  }
}

TEST(ShDegree4, AnSpzKeepsThemWithinItsRounding) {
  TempFolder folder;
  GaussianModel before = Scene(60);
  WriteSplat(folder / "a.spz", before);
  GaussianModel after = ReadSplat(folder / "a.spz");
  const ShBand4Columns was(before), is(after);
  ASSERT_TRUE(is.present());
  for (size_t g = 0; g < 60; ++g) {
    for (size_t i = 0; i < 27; ++i) {
      // Rounded to 1/128, then to 1/8.
      ASSERT_NEAR(is.Get(g)[i], was.Get(g)[i], 1 / 16.0 + 1 / 256.0 + 1e-6) << g << " " << i;
    }
  }
  WriteSplat(folder / "b.spz", after);
  EXPECT_EQ(ReadFile(folder / "a.spz"), ReadFile(folder / "b.spz"));
  // From one format to the other.
  WriteSplat(folder / "c.ply", after);
  GaussianModel ply = ReadSplat(folder / "c.ply");
  EXPECT_EQ(ShBand4Columns(ply).Get(33), is.Get(33));
}

TEST(ShDegree4, OtherFormatsSayThatTheyDropThem) {
  TempFolder folder;
  const GaussianModel scene = Scene(20);
  for (const char* name : {"a.sog", "a.glb", "a.compressed.ply", "a.splat"}) {
    SCOPED_TRACE(name);
    const std::vector<std::string> losses = CodecForWriting(folder / name).Losses(scene);
    EXPECT_THAT(losses, Contains(HasSubstr("the scene has degree 4")));
    EXPECT_EQ(losses.size(), 1u);
    if (std::string_view(name) == "a.glb") {
      EXPECT_THAT(losses[0], HasSubstr("above degree 3 are dropped, where glTF "
                                       "(KHR_gaussian_splatting) ends"));
    }
    WriteSplat(folder / name, scene);
    EXPECT_FALSE(HasShBand4(ReadSplat(folder / name)));
  }
}

// A half turn about x changes the signs of y and z, and with them those of the functions that are
// odd in both together.
TEST(ShDegree4, ATransformTurnsThem) {
  GaussianModel scene = Scene(3);
  const ShBand4 before = ShBand4Columns(scene).Get(1);
  Sim3d half_turn;
  half_turn.rotation = Eigen::Quaterniond(0, 1, 0, 0);
  Transform(half_turn, scene);
  const ShBand4 after = ShBand4Columns(scene).Get(1);
  constexpr float kSigns[9] = {-1, 1, -1, 1, 1, -1, 1, -1, 1};
  for (size_t i = 0; i < 27; ++i) EXPECT_NEAR(after[i], kSigns[i / 3] * before[i], 1e-6) << i;
}

}  // namespace
}  // namespace retint
