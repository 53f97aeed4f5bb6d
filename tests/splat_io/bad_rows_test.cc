// SPDX-License-Identifier: BSD-3-Clause
// Gaussians with a value that is NaN: rejected with advice, or dropped and counted.
#include <cmath>

#include <gmock/gmock.h>

#include "base/monitor.h"
#include "splat_io/splat_io.h"
#include "tests/splat_io/ply_text.h"
#include "tests/splat_io/random_scene.h"

namespace retint {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// Overwrites a float of the file.
void Spoil(const std::filesystem::path& path, size_t offset, float value) {
  std::string bytes = ReadFile(path);
  std::memcpy(bytes.data() + offset, &value, sizeof value);
  SpillFile(path, bytes);
}

TEST(BadRows, OfAPlyAreLeftOutWithTheirColumns) {
  TempFolder folder;
  GaussianModel scene = RandomScene(6, 1);
  ExtraColumn label{"label", "uchar", 1, {10, 11, 12, 13, 14, 15}};
  scene.source.extras.push_back(label);
  scene.source.property_order = {"x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2"};
  for (int i = 0; i < 9; ++i) scene.source.property_order.push_back("f_rest_" + std::to_string(i));
  for (const char* name :
       {"opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3", "label"}) {
    scene.source.property_order.push_back(name);
  }
  WriteSplat(folder / "a.ply", scene);
  const size_t body = ReadFile(folder / "a.ply").find("end_header\n") + 11;
  const size_t row = 23 * 4 + 1;
  Spoil(folder / "a.ply", body + 1 * row + 4, NAN);
  Spoil(folder / "a.ply", body + 4 * row + 22 * 4, -INFINITY);
  EXPECT_THAT(MessageOf<InputError>([&] { ReadSplat(folder / "a.ply"); }),
              HasSubstr("Gaussian 1: y is NaN; `retint convert` with `drop_bad`"));
  Monitor monitor;
  const GaussianModel good = ReadSplat(folder / "a.ply", monitor, BadRows::kDrop);
  ASSERT_EQ(good.NumGaussians(), 4u);
  EXPECT_NO_THROW(good.Validate());
  EXPECT_THAT(good.source.extras[0].bytes, ElementsAre(10, 12, 13, 15));
  EXPECT_THAT(good.source.notes,
              ElementsAre(HasSubstr("2 Gaussians with a value that is NaN or infinite")));
  EXPECT_EQ(good.means[3], scene.means[6]);
  WriteSplat(folder / "b.ply", good);
  EXPECT_EQ(ReadSplat(folder / "b.ply").sh, good.sh);
}

// The others are packed again: the file's own bytes are of all rows.
TEST(BadRows, OfAPackedFileAreLeftOut) {
  TempFolder folder;
  WriteSplat(folder / "a.splat", RandomScene(5, 0));
  const GaussianModel all = ReadSplat(folder / "a.splat");
  Spoil(folder / "a.splat", 2 * 32 + 8, NAN);
  EXPECT_THAT(MessageOf<InputError>([&] { ReadSplat(folder / "a.splat"); }),
              HasSubstr("Gaussian 2: mean is NaN; `retint convert` with `drop_bad`"));
  Monitor monitor;
  const GaussianModel good = ReadSplat(folder / "a.splat", monitor, BadRows::kDrop);
  ASSERT_EQ(good.NumGaussians(), 4u);
  EXPECT_EQ(good.means[6], all.means[9]);
  WriteSplat(folder / "b.splat", good);
  EXPECT_EQ(ReadSplat(folder / "b.splat").means, good.means);
}

TEST(BadRows, NothingIsLeftOutOfAGoodFileAndAllOfNone) {
  TempFolder folder;
  WriteSplat(folder / "a.splat", RandomScene(1, 0));
  Monitor monitor;
  const GaussianModel whole = ReadSplat(folder / "a.splat", monitor, BadRows::kDrop);
  EXPECT_TRUE(whole.source.notes.empty());
  EXPECT_FALSE(whole.source.packed.empty());
  Spoil(folder / "a.splat", 0, NAN);
  EXPECT_THAT(
      MessageOf<InputError>([&] { ReadSplat(folder / "a.splat", monitor, BadRows::kDrop); }),
      HasSubstr("every Gaussian has a value that is NaN"));
}

}  // namespace
}  // namespace retint
