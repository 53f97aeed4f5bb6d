// SPDX-License-Identifier: BSD-3-Clause
// Duties of every format with rounded values: its own precision, and unchanged bytes of unedited
// values.
#include <algorithm>

#include <gmock/gmock.h>

#include "splat_io/compression.h"
#include "splat_io/splat_io.h"
#include "tests/splat_io/ply_text.h"
#include "tests/splat_io/random_scene.h"

namespace retint {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

struct Format {
  const char* extension;
  int max_degree;
  Rounding rounding;
};

void PrintTo(const Format& format, std::ostream* out) { *out << format.extension; }

// Half a step of the stored values, and 1e-6 for float arithmetic.
const Format kFormats[] = {
    // Bytes of [0, 1] for color and opacity; rotation bytes of 1/128 each, of which q = 1 misses a
    // whole step, twice that for normalizing. Scales go through expf and logf.
    {".splat", 0, {0, 2e-6, 0.5 / 255 + 1e-6, 0.5 / 255 + 1e-6, 0, 2.0 / 128}},
    // The y axis has 10 bits, of a box that is at most the scene's: 10 long, 9 in log scale, 0.96
    // in
    // color. SH: 8 in 256 steps. Rotation: sqrt(2) in 1023 steps; the largest component, at least a
    // half, takes up to 3 times that.
    {".compressed.ply",
     3,
     {0.5 * 10 / 1023 + 1e-6, 0.5 * 9 / 1023 + 1e-6, 0.5 / 255 + 1e-6, 0.5 * 0.96 / 255 + 1e-6,
      0.5 * 8 / 256 + 1e-6, 3 * 0.5 * 1.4143 / 1023}},
    // 5 steps in 16 fractional bits. Log scale in sixteenths. DC steps of 1 / (255 * 0.15). SH
    // degrees above 1: steps of 16 / 128 after rounding to 1/128. Rotation: sqrt(1/2) in 511 steps.
    {".spz",
     3,
     {0.5 / 65536 + 1e-6, 0.5 / 16 + 1e-6, 0.5 / 255 + 1e-6, 0.28209479 * 0.5 / (255 * 0.15) + 1e-6,
      0.5 * 16 / 128 + 0.5 / 128 + 1e-6, 3 * 0.5 * 0.70711 / 511}},
};

class PackedFormatTest : public ::testing::TestWithParam<Format> {
 protected:
  std::filesystem::path In() const { return folder_ / ("in" + std::string(GetParam().extension)); }
  std::filesystem::path Out() const {
    return folder_ / ("out" + std::string(GetParam().extension));
  }
  const SplatCodec& Codec() const { return CodecForWriting(Out()); }
  TempFolder folder_;
};

TEST_P(PackedFormatTest, RoundTripsWithinItsRounding) {
  for (int degree = 0; degree <= 3; ++degree) {
    SCOPED_TRACE(degree);
    // 600 Gaussians fill two chunks of 256 and a part of a third.
    const GaussianModel model = RandomScene(600, degree);
    WriteSplat(Out(), model);
    const GaussianModel back = ReadSplat(Out());
    EXPECT_EQ(back.sh_degree, std::min(degree, GetParam().max_degree));
    EXPECT_NO_THROW(back.Validate());
    ExpectNear(model, back, GetParam().rounding, Codec().WriteOrder(model));
    EXPECT_EQ(Codec().Losses(model).size(), degree > GetParam().max_degree ? 1u : 0u);
  }
}

TEST_P(PackedFormatTest, OneGaussian) {
  const GaussianModel model = RandomScene(1, 3, 7);
  WriteSplat(Out(), model);
  ExpectNear(model, ReadSplat(Out()), GetParam().rounding);
}

// Values that rounding turns into each other at the ends: opacities 0 and 1, no rotation, sizes
// that underflow, colors far outside.
TEST_P(PackedFormatTest, ExtremesStayFinite) {
  GaussianModel model = RandomScene(8, 1);
  model.opacity_logits = {-100, 100, 0, 15, -15, 1, 2, 3};
  std::fill_n(model.quats_wxyz.begin(), 4, 0.0f);
  std::fill_n(model.log_scales.begin(), 3, -120.0f);
  std::fill_n(model.log_scales.begin() + 3, 3, 90.0f);
  std::fill_n(model.sh.begin(), 12, 50.0f);
  std::fill_n(model.sh.begin() + 12, 12, -50.0f);
  std::fill_n(model.means.begin(), 3, 0.0f);
  WriteSplat(Out(), model);
  GaussianModel back;
  ASSERT_NO_THROW(back = ReadSplat(Out()));
  const std::vector<uint32_t> order = Codec().WriteOrder(model);
  const size_t first =
      order.empty() ? 0 : size_t(std::find(order.begin(), order.end(), 0u) - order.begin());
  EXPECT_LT(back.opacity_logits[first], -5);
  const size_t width = size_t(back.NumShCoeffs()) * 3;
  EXPECT_GE(back.sh[first * width], 1.7f);  // at least white
}

TEST_P(PackedFormatTest, WrittenAgainHasTheSameBytes) {
  WriteSplat(In(), RandomScene(600, GetParam().max_degree));
  WriteSplat(Out(), ReadSplat(In()));
  EXPECT_TRUE(ReadFile(Out()) == ReadFile(In()));
}

// The data, unpacked where it is compressed.
std::string Data(const std::filesystem::path& path) {
  const std::string file = ReadFile(path);
  if (!file.starts_with("\x1f\x8b")) return file;
  UnsetVector<char> bytes;
  Gunzip(
      file, 16, [](std::string_view) { return size_t{1} << 20; }, [](size_t) {}, bytes);
  return {bytes.begin(), bytes.end()};
}

TEST_P(PackedFormatTest, AnEditChangesItsOwnBytesOnly) {
  const size_t count = 600, edited = 300;
  WriteSplat(In(), RandomScene(count, GetParam().max_degree));
  GaussianModel model = ReadSplat(In());
  const GaussianModel was = model;
  const size_t width = size_t(model.NumShCoeffs()) * 3;
  // Within the chunk's colors: those of its next Gaussian.
  for (size_t i = 0; i < width; ++i) {
    model.sh[edited * width + i] = model.sh[(edited + 1) * width + i];
  }
  WriteSplat(Out(), model);
  const std::string before = Data(In()), after = Data(Out());
  ASSERT_EQ(after.size(), before.size());
  size_t differ = 0;
  for (size_t i = 0; i < before.size(); ++i) differ += before[i] != after[i];
  EXPECT_GT(differ, 0u);
  EXPECT_LE(differ, width);  // one byte a coefficient

  const GaussianModel back = ReadSplat(Out());
  EXPECT_EQ(back.means, was.means);
  EXPECT_EQ(back.quats_wxyz, was.quats_wxyz);
  EXPECT_EQ(back.log_scales, was.log_scales);
  EXPECT_EQ(back.opacity_logits, was.opacity_logits);
  for (size_t g = 0; g < count; ++g) {
    for (size_t i = 0; i < width; ++i) {
      const float expected = g == edited ? model.sh[g * width + i] : was.sh[g * width + i];
      // .spz rounds a new coefficient to the values that the source's had: it keeps them too.
      ASSERT_EQ(back.sh[g * width + i], expected) << g << " " << i;
    }
  }
}

// Every value changed: nothing of the source is left over.
TEST_P(PackedFormatTest, AnotherSceneUnderTheSourceRoundTripsToo) {
  WriteSplat(In(), RandomScene(600, GetParam().max_degree));
  GaussianModel model = RandomScene(600, GetParam().max_degree, 2);
  model.source = ReadSplat(In()).source;
  for (float& x : model.means) x *= 1.2f;  // beyond the chunks' boxes
  WriteSplat(Out(), model);
  // Chunks keep the source's Gaussians: their boxes are the whole scene, 12 long here.
  Rounding rounding = GetParam().rounding;
  rounding.mean *= 1.2;
  ExpectNear(model, ReadSplat(Out()), rounding);
}

TEST_P(PackedFormatTest, AChangedDegreeIsWrittenAnew) {
  WriteSplat(In(), RandomScene(20, GetParam().max_degree));
  GaussianModel model = RandomScene(20, GetParam().max_degree == 0 ? 2 : 1);
  model.source = ReadSplat(In()).source;
  WriteSplat(Out(), model);
  ExpectNear(model, ReadSplat(Out()), GetParam().rounding, Codec().WriteOrder(model));
}

TEST_P(PackedFormatTest, AModelThatCannotBeReadBackIsNotWritten) {
  WriteFile(Out(), "precious");
  const auto refused = [&](const GaussianModel& model) {
    const std::string message = MessageOf<RunError>([&] { WriteSplat(Out(), model); });
    EXPECT_EQ(ReadFile(Out()), "precious");
    EXPECT_THAT(message, HasSubstr(Out().string() + ": not written: "));
    return message;
  };
  GaussianModel model = RandomScene(2, 1);
  model.sh[13] = NAN;
  EXPECT_THAT(refused(model), HasSubstr("Gaussian 1: spherical harmonics is NaN"));
  EXPECT_THAT(refused({}), HasSubstr("no Gaussians"));
  model = RandomScene(2, 1);
  model.sh_degree = 4;
  EXPECT_THAT(refused(model), HasSubstr("degree"));
}

class CancelsOnTheWay : public Monitor {
 public:
  CancelsOnTheWay()
      : Monitor([this](const Progress& step) {
          reached = std::max(reached, step.fraction);
          if (step.fraction > 1.0 / 3) Cancel();
        }) {}
  double reached = 0;
};

TEST_P(PackedFormatTest, ReadingAndWritingReportAndAreCancelled) {
  const GaussianModel model = RandomScene(60000, 0);
  WriteSplat(In(), model);
  WriteFile(Out(), "precious");
  CancelsOnTheWay writing, reading;
  EXPECT_THROW(WriteSplat(Out(), model, writing), Cancelled);
  EXPECT_GT(writing.reached, 1.0 / 3);
  EXPECT_EQ(ReadFile(Out()), "precious");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder_.path()), {}), 2);
  EXPECT_THROW(ReadSplat(In(), reading), Cancelled);
  EXPECT_GT(reading.reached, 1.0 / 3);
}

TEST_P(PackedFormatTest, NamesWhatItDrops) {
  GaussianModel model = RandomScene(2, 0);
  EXPECT_THAT(Codec().Losses(model), IsEmpty());
  model.source.extras = {{"nx", "float", 4, {}}, {"label", "uchar", 1, {}}};
  ASSERT_THAT(Codec().Losses(model), SizeIs(1));
  EXPECT_THAT(Codec().Losses(model)[0], HasSubstr("dropped: label"));
}

INSTANTIATE_TEST_SUITE_P(Formats, PackedFormatTest, ::testing::ValuesIn(kFormats),
                         [](const auto& test) {
                           std::string name = test.param.extension + 1;
                           std::erase(name, '.');
                           return name;
                         });

// Outside of its chunk's colors: the box grows and the colors of that chunk alone are packed anew.
TEST(CompressedPlyTest, ANewColorOutsideOfItsChunkLeavesOtherChunksAndGeometryAlone) {
  const TempFolder folder;
  const size_t count = 600;
  WriteSplat(folder / "in.compressed.ply", RandomScene(count, 1));
  GaussianModel model = ReadSplat(folder / "in.compressed.ply");
  const GaussianModel was = model;
  model.sh[300 * 12] = 5;  // red of the second chunk
  WriteSplat(folder / "out.compressed.ply", model);
  const GaussianModel back = ReadSplat(folder / "out.compressed.ply");
  EXPECT_EQ(back.means, was.means);
  EXPECT_EQ(back.quats_wxyz, was.quats_wxyz);
  EXPECT_EQ(back.log_scales, was.log_scales);
  EXPECT_EQ(back.opacity_logits, was.opacity_logits);
  // Reds of the chunk now share 0.5 + 5 / 3.54 = 1.9 among 255 steps.
  EXPECT_NEAR(back.sh[300 * 12], 5, 1e-5);
  for (size_t g = 0; g < count; ++g) {
    for (size_t i = 0; i < 12; ++i) {
      const float now = back.sh[g * 12 + i], then = model.sh[g * 12 + i];
      if (g / 256 == 1 && i == 0) {
        ASSERT_NEAR(now, then, 0.5 * 1.95 / 255 * 3.5449 + 1e-5);
      } else if (g / 256 == 1 && i < 3) {
        ASSERT_NEAR(now, then, 1e-5);  // the same box, so the same byte
      } else {
        ASSERT_EQ(now, then) << g << " " << i;
      }
    }
  }
}

TEST(CompressedPlyTest, NeighborsShareChunks) {
  const TempFolder folder;
  // 4096 Gaussians in 10^3: a chunk of 256 covers about a sixteenth, 4 long.
  const GaussianModel model = RandomScene(4096, 0);
  WriteSplat(folder / "a.compressed.ply", model);
  const GaussianModel back = ReadSplat(folder / "a.compressed.ply");
  const std::vector<uint32_t> order =
      CodecForWriting(folder / "a.compressed.ply").WriteOrder(model);
  double error = 0;
  for (size_t i = 0; i < back.means.size(); ++i) {
    error +=
        std::abs(back.means[i] - model.means[3 * order[i / 3] + i % 3]) / double(order.size() * 3);
  }
  // The mean of a uniform error over half a step, for boxes as large as the scene with 11, 10 and
  // 11 bits. About half of it is expected.
  const double unsorted = (10.0 / 2047 + 10.0 / 1023 + 10.0 / 2047) / 3 / 4;
  EXPECT_LT(error, 0.75 * unsorted);
}

TEST(SpzTest, FarScenesGetFewerFractionalBits) {
  const TempFolder folder;
  GaussianModel model = RandomScene(4, 0);
  model.means[0] = 100000;  // 17 bits, a sign, 6 left for the fraction
  WriteSplat(folder / "a.spz", model);
  const GaussianModel back = ReadSplat(folder / "a.spz");
  for (size_t i = 0; i < 12; ++i) EXPECT_NEAR(back.means[i], model.means[i], 0.5 / 64);
  model.means[0] = 1e7f;
  EXPECT_THAT(MessageOf<RunError>([&] { WriteSplat(folder / "a.spz", model); }),
              HasSubstr("Gaussian 0: mean is beyond"));
}

TEST(SpzTest, SaysThatScalesAreClamped) {
  GaussianModel model = RandomScene(4, 0);
  model.log_scales[4] = -11;
  const auto losses = CodecForWriting("a.spz").Losses(model);
  ASSERT_THAT(losses, SizeIs(1));
  EXPECT_THAT(losses[0], HasSubstr("scales of 1 Gaussians"));
}

}  // namespace
}  // namespace retint
