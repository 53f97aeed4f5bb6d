// SPDX-License-Identifier: BSD-3-Clause
// OpenUSD stages with ParticleField3DGaussianSplat.
#include <cmath>

#include <gmock/gmock.h>

#include "splat_io/splat_io.h"
#include "splat_io/splat_row.h"
#include "splat_io/usd_package.h"
#include "splat_io/usd_splats.h"
#include "tests/splat_io/ply_text.h"
#include "tests/splat_io/random_scene.h"

namespace retint {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

// Floats throughout: rotations are normalized, scales go through expf and logf, opacities lie in
// [0, 1].
constexpr Rounding kRounding = {0, 2e-6, 1e-6, 0, 0, 1e-6};

// One red Gaussian at (1, 2, 3) of a stage, twice as long in x as in y and z.
constexpr char kOne[] = R"(def ParticleField3DGaussianSplat "One" (
        prepend apiSchemas = ["ColorSpaceAPI"]
    )
    {
        float[] primvars:weight = [0.5]   # not ours
        point3f[] positions = [(1, 2, 3)]
        quatf[] orientations = [(1, 0, 0, 0)]
        float3[] scales = [(2, 1, 1)]
        float[] opacities = [0.25]
        float3[] radiance:sphericalHarmonicsCoefficients = [(1, 0, 0), (0.1, 0, 0), (0.2, 0, 0), (0.3, 0, 0)] (elementSize = 4)
        uniform int radiance:sphericalHarmonicsDegree = 1
    }
)";

std::string Stage(const std::string& metadata, const std::string& above, const std::string& prims) {
  return "#usda 1.0\n(\n    " + metadata + "\n)\n\ndef Xform \"World\"\n{\n    " + above +
         "\n    " + prims + "}\n";
}

std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

class UsdTest : public ::testing::Test {
 protected:
  GaussianModel Read(const std::string& text, const char* name = "in.usda") {
    SpillFile(folder_ / name, text);
    return ReadSplat(folder_ / name);
  }
  std::string Refusal(const std::string& bytes, const char* name = "bad.usda") {
    SpillFile(folder_ / name, bytes);
    const std::string message = MessageOf<InputError>([&] { ReadSplat(folder_ / name); });
    EXPECT_THAT(message, AllOf(HasSubstr((folder_ / name).string() + ":"), Not(HasSubstr("\n"))));
    return message;
  }
  TempFolder folder_;
};

TEST_F(UsdTest, RoundTripsInEveryForm) {
  for (int degree = 0; degree <= 3; ++degree) {
    const GaussianModel model = RandomScene(5000, degree);  // more than a block
    for (const char* name : {"a.usda", "a.usdc", "a.usdz", "a.usd"}) {
      SCOPED_TRACE(std::string(name) + " " + std::to_string(degree));
      WriteSplat(folder_ / name, model);
      const GaussianModel back = ReadSplat(folder_ / name);
      EXPECT_EQ(back.sh_degree, degree);
      EXPECT_THAT(back.source.notes, ElementsAre());
      ExpectNear(model, back, kRounding);
    }
  }
}

// Right-up-back: y and z of the .ply change sign.
TEST_F(UsdTest, IsRightUpBackInMeters) {
  const std::string metadata = "upAxis = \"Y\"\n    metersPerUnit = 1";
  const GaussianModel one = Read(Stage(metadata, "", kOne));
  ASSERT_EQ(one.NumGaussians(), 1u);
  EXPECT_THAT(one.means, ElementsAre(1, -2, -3));
  EXPECT_NEAR(one.log_scales[0], std::log(2), 1e-6);
  EXPECT_NEAR(Sigmoid(one.opacity_logits[0]), 0.25, 1e-6);
  EXPECT_EQ(one.sh_degree, 1);
  // Degree 1 is -y, z, -x of the direction: the first two change sign.
  EXPECT_FLOAT_EQ(one.sh[3], -0.1F);
  EXPECT_FLOAT_EQ(one.sh[6], -0.2F);
  EXPECT_FLOAT_EQ(one.sh[9], 0.3F);
  // A stage in centimeters.
  const GaussianModel small = Read(Stage("metersPerUnit = 0.01", "", kOne));
  EXPECT_NEAR(small.means[1], -0.02, 1e-7);
  EXPECT_NEAR(small.log_scales[0], std::log(0.02), 1e-5);
  // z up: (1, 2, 3) is 3 above the ground and 2 behind, which is in front of the viewer.
  const GaussianModel up = Read(Stage("upAxis = \"Z\"\n metersPerUnit = 1", "", kOne));
  EXPECT_NEAR(up.means[0], 1, 1e-6);
  EXPECT_NEAR(up.means[1], -3, 1e-6);
  EXPECT_NEAR(up.means[2], 2, 1e-6);
  const GaussianModel plain = Read(Stage("doc = \"\"\"no unit\n(\"\"\"", "", kOne));
  EXPECT_FLOAT_EQ(plain.means[0], 1);
  EXPECT_THAT(plain.source.notes, Contains(HasSubstr("no metersPerUnit")));
}

// Every operation against the same transform as one matrix.
TEST_F(UsdTest, TransformsAboveAPrimMoveItsGaussians) {
  const auto moved = [&](const std::string& above) {
    return Read(Stage("metersPerUnit = 1", above, kOne));
  };
  const auto expect_same = [&](const std::string& operations, const std::string& matrix) {
    SCOPED_TRACE(operations);
    const GaussianModel a = moved(operations);
    const GaussianModel b = moved("matrix4d xformOp:transform = " + matrix +
                                  "\n    uniform token[] xformOpOrder = [\"xformOp:transform\"]");
    ExpectNear(a, b, {1e-5, 1e-5, 1e-6, 1e-6, 1e-6, 1e-6});
  };
  // Rows, so that the translation is the last one.
  expect_same(R"(double3 xformOp:translate = (5, 6, 7)
    float3 xformOp:scale = (2, 2, 2)
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"])",
              "( (2, 0, 0, 0), (0, 2, 0, 0), (0, 0, 2, 0), (5, 6, 7, 1) )");
  // 90 degrees about z: x to y. Then about x: y to z.
  expect_same(R"(float3 xformOp:rotateZXY = (90, 0, 90)
    uniform token[] xformOpOrder = ["xformOp:rotateZXY"])",
              "( (0, 0, 1, 0), (-1, 0, 0, 0), (0, -1, 0, 0), (0, 0, 0, 1) )");
  expect_same(R"(float xformOp:rotateX = 90
    double xformOp:rotateZ:second = 90
    uniform token[] xformOpOrder = ["xformOp:rotateX", "xformOp:rotateZ:second"])",
              "( (0, 0, 1, 0), (-1, 0, 0, 0), (0, -1, 0, 0), (0, 0, 0, 1) )");
  expect_same(R"(quatf xformOp:orient = (0.70710678, 0, 0, 0.70710678)
    float3 xformOp:translate:pivot = (1, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate:pivot", "xformOp:orient", "!invert!xformOp:translate:pivot"])",
              "( (0, 1, 0, 0), (-1, 0, 0, 0), (0, 0, 1, 0), (1, -1, 0, 1) )");
  // A quarter turn about z in the stage turns degree 1 with the directions.
  const GaussianModel turned = moved(R"(float xformOp:rotateZ = 90
    uniform token[] xformOpOrder = ["xformOp:rotateZ"])");
  EXPECT_NEAR(turned.means[0], -2, 1e-5);
  EXPECT_NEAR(turned.means[1], -1, 1e-5);
  // In the stage -y, z, -x: 0.1, 0.2, 0.3; x' = -y and y' = x, so that they become 0.3, 0.2, -0.1;
  // then y and z change sign.
  EXPECT_NEAR(turned.sh[3], -0.3, 1e-6);
  EXPECT_NEAR(turned.sh[6], -0.2, 1e-6);
  EXPECT_NEAR(turned.sh[9], -0.1, 1e-6);
  const GaussianModel reset = Read(Stage(
      "metersPerUnit = 1",
      "float xformOp:scaleX = 3\n    uniform token[] xformOpOrder = [\"xformOp:scaleX\"]",
      Replaced(kOne, "float[] opacities",
               "uniform token[] xformOpOrder = [\"!resetXformStack!\"]\n float[] opacities")));
  EXPECT_THAT(reset.means, ElementsAre(1, -2, -3));
}

TEST_F(UsdTest, HalvesAndFallbacksAreRead) {
  const std::string metadata = "metersPerUnit = 1";
  std::string halves = kOne;
  for (const auto& [from, to] : std::vector<std::pair<std::string, std::string>>{
           {"point3f[] positions", "point3h[] positionsh"},
           {"quatf[] orientations", "quath[] orientationsh"},
           {"float3[] scales", "half3[] scalesh"},
           {"float[] opacities", "half[] opacitiesh"},
           {"float3[] radiance:sphericalHarmonicsCoefficients",
            "half3[] radiance:sphericalHarmonicsCoefficientsh"}}) {
    halves = Replaced(halves, from, to);
  }
  ExpectNear(Read(Stage(metadata, "", halves)), Read(Stage(metadata, "", kOne)), kRounding);
  // Floats come first.
  EXPECT_THAT(Read(Stage(metadata, "",
                         Replaced(kOne, "float[] opac",
                                  "point3h[] positionsh = [(9, 9, 9), (8, 8, 8)]\n"
                                  "float[] opac")))
                  .means,
              ElementsAre(1, -2, -3));
  const GaussianModel bare = Read(Stage(
      metadata, "",
      "def ParticleField3DGaussianSplat \"A\" { point3f[] positions = [(0, 0, 0), (1, 1, 1)] }"));
  EXPECT_EQ(bare.NumGaussians(), 2u);
  EXPECT_EQ(bare.sh_degree, 0);
  EXPECT_EQ(bare.log_scales[5], 0);
  EXPECT_EQ(bare.sh[3], 0);
  EXPECT_GT(bare.opacity_logits[1], 10);
}

TEST_F(UsdTest, ColorSpacesAreKept) {
  const auto read = [&](const std::string& above, const std::string& of_attribute) {
    return Read(Stage("metersPerUnit = 1", above,
                      Replaced(kOne, "elementSize = 4", "elementSize = 4 " + of_attribute)));
  };
  EXPECT_EQ(read("", "").traits.color_space, ColorSpace::kSrgbDisplay);
  const std::string linear = "uniform token colorSpace:name = \"lin_rec709_scene\"";
  EXPECT_EQ(read(linear, "").traits.color_space, ColorSpace::kLinearScene);
  EXPECT_EQ(read(linear, "colorSpace = \"lin_rec709_display\"").traits.color_space,
            ColorSpace::kLinearDisplay);
  EXPECT_THAT(read("", "colorSpace = \"lin_ap1_scene\"").source.notes,
              ElementsAre(HasSubstr("space is unknown")));
  GaussianModel model = RandomScene(3, 1);
  for (const char* name : {"a.usda", "a.usdc", "a.usdz"}) {
    model.traits.color_space = ColorSpace::kLinearDisplay;
    WriteSplat(folder_ / name, model);
    GaussianModel back = ReadSplat(folder_ / name);
    EXPECT_EQ(back.traits.color_space, ColorSpace::kLinearDisplay) << name;
    back.traits.color_space = ColorSpace::kSrgbDisplay;
    WriteSplat(folder_ / name, back);
    EXPECT_EQ(ReadSplat(folder_ / name).traits.color_space, ColorSpace::kSrgbDisplay) << name;
  }
}

TEST_F(UsdTest, FloatToHalfIsTheNearestOne) {
  for (uint32_t half = 0; half < 0x7c00; ++half) {
    const float value = HalfToFloat(static_cast<uint16_t>(half));
    ASSERT_EQ(FloatToHalf(value), half);
    ASSERT_EQ(FloatToHalf(-value), half | 0x8000);
    if (half == 0x7bff) continue;
    const float next = HalfToFloat(static_cast<uint16_t>(half + 1));
    ASSERT_EQ(FloatToHalf(value + 0.25F * (next - value)), half);
    ASSERT_EQ(FloatToHalf(value + 0.75F * (next - value)), half + 1);
    ASSERT_EQ(FloatToHalf(value + 0.5F * (next - value)), half + half % 2);  // ties to even
  }
  EXPECT_EQ(FloatToHalf(1e9F), 0x7c00);
}

// Unedited values, and the rest of the stage, come back letter by letter.
TEST_F(UsdTest, AnEditChangesNothingElse) {
  const std::string second =
      Replaced(Replaced(kOne, "\"One\"", "\"Two\""), "(1, 2, 3)", "( 4,\t5 ,6.0e0 ) # a comment\n");
  const std::string text = Stage(
      "metersPerUnit = 0.5\n    upAxis = \"Z\"\n    customLayerData = { string a = \"}\" }",
      "float xformOp:rotateZ = 90\n    uniform token[] xformOpOrder = [\"xformOp:rotateZ\"]",
      std::string(kOne) + "def Mesh \"Chair\" (references = @chair.usd@</C> (offset = 2)) {\n" +
          "int[] faceVertexCounts = [4, -4, 1e-5]\n double3 xformOp:translate.timeSamples = { 0: "
          "(1, 2, 3), }}\n" +
          second);
  GaussianModel model = Read(text);
  ASSERT_EQ(model.NumGaussians(), 2u);
  EXPECT_THAT(model.source.notes, ElementsAre(AllOf(HasSubstr("other prims"),
                                                    HasSubstr("lost unless"), HasSubstr(": Chair")),
                                              HasSubstr("other layers")));
  WriteSplat(folder_ / "out.usda", model);
  EXPECT_EQ(ReadFile(folder_ / "out.usda"), text);
  const GaussianModel was = model;
  model.sh[12] = 0.5F;  // red of the second one
  model.sh[12 + 9] = 0.125F;
  WriteSplat(folder_ / "out.usda", model);
  const std::string out = ReadFile(folder_ / "out.usda");
  const GaussianModel back = ReadSplat(folder_ / "out.usda");
  for (size_t i = 0; i < 24; ++i) {
    // The edited one went through the prim's frame and back; its neighbor did not.
    EXPECT_NEAR(back.sh[i], model.sh[i], i < 12 ? 0 : 1e-6) << i;
  }
  EXPECT_EQ(back.means, was.means);
  const size_t changed = text.rfind("[(1, 0, 0), (0.1");
  EXPECT_EQ(out.substr(0, changed), text.substr(0, changed));
  const size_t behind = text.rfind("] (elementSize");
  EXPECT_THAT(out, ::testing::EndsWith(text.substr(behind)));
  EXPECT_EQ(out.substr(changed, 6), "[(0.5,");
  // A scene that is moved: values change, the rest stays.
  GaussianModel moved = was;
  moved.means[3] += 1;
  WriteSplat(folder_ / "moved.usda", moved);
  const GaussianModel again = ReadSplat(folder_ / "moved.usda");
  for (size_t i = 0; i < 6; ++i) EXPECT_NEAR(again.means[i], moved.means[i], 1e-5);
  EXPECT_THAT(ReadFile(folder_ / "moved.usda"), HasSubstr("chair.usd"));
}

TEST_F(UsdTest, PackagesAreAlignedAndKeepTheirFiles) {
  const GaussianModel model = RandomScene(3, 1);
  WriteSplat(folder_ / "a.usdz", model);
  const std::string bytes = ReadFile(folder_ / "a.usdz");
  const auto files = ReadUsdPackage(bytes, "a.usdz");
  ASSERT_EQ(files.size(), 1u);
  EXPECT_EQ((files[0].bytes.data() - bytes.data()) % 64, 0);
  // Another program's package, with a texture.
  const std::string text = Stage("metersPerUnit = 1", "", kOne);
  {
    AtomicFile file(folder_ / "b.usdz");
    const std::filesystem::path path = folder_ / "b.usdz";
    UsdPackageWriter writer(file, path);
    writer.Add("root.usda", [&](const auto& write) { write(text); });
    writer.Add("0/a picture.png", [&](const auto& write) { write("PNG"); });
    writer.Finish();
    file.Commit();
  }
  GaussianModel one = ReadSplat(folder_ / "b.usdz");
  one.sh[0] = 0.25F;
  WriteSplat(folder_ / "c.usdz", one);
  const std::string edited = ReadFile(folder_ / "c.usdz");
  const auto kept = ReadUsdPackage(edited, "c.usdz");
  ASSERT_EQ(kept.size(), 2u);
  EXPECT_EQ(kept[0].name, "root.usda");
  EXPECT_EQ(kept[0].bytes, Replaced(text, "[(1, 0, 0), (0.1", "[(0.25, 0, 0), (0.1"));
  EXPECT_EQ(kept[1].name, "0/a picture.png");
  EXPECT_EQ(kept[1].bytes, "PNG");
  for (const UsdPackageFile& file : kept) EXPECT_EQ((file.bytes.data() - edited.data()) % 64, 0);
  std::string damaged = edited;
  damaged[size_t(kept[1].bytes.data() - edited.data())] ^= 1;
  EXPECT_THAT(Refusal(damaged, "bad.usdz"), HasSubstr("a picture.png is damaged"));
  EXPECT_THAT(Refusal(edited.substr(0, edited.size() - 30), "bad.usdz"), HasSubstr("truncated"));
  EXPECT_EQ(system(("cd " + folder_.path().string() + " && python3 -m zipfile -t c.usdz >/dev/null")
                       .c_str()),
            0);
}

// NVIDIA's SimReady rules for splats (SPL.003, SPL.005, VG.035), for files that Retint writes.
TEST_F(UsdTest, SatisfiesPublishedRules) {
  GaussianModel model = RandomScene(50, 2);
  model.quats_wxyz[0] = model.quats_wxyz[1] = model.quats_wxyz[2] = model.quats_wxyz[3] = 0;
  model.opacity_logits[3] = 60;
  WriteSplat(folder_ / "a.usda", model);
  const std::string text = ReadFile(folder_ / "a.usda");
  for (const char* part :
       {"defaultPrim = \"Gaussians\"", "metersPerUnit = 1", "upAxis = \"Y\"", "elementSize = 9",
        "uniform int radiance:sphericalHarmonicsDegree = 2", "float3[] extent = [(",
        "uniform token projectionModeHint = \"perspective\"",
        "uniform token sortingModeHint = \"zDepth\""}) {
    EXPECT_THAT(text, HasSubstr(part));
  }
  const auto numbers = [&](const std::string& name) {
    const size_t begin = text.find(" " + name + " = [") + name.size() + 5;
    std::string list = text.substr(begin, text.find(']', begin) - begin);
    for (char& c : list) c = c == '(' || c == ')' || c == ',' ? ' ' : c;
    std::istringstream stream(list);
    return std::vector<double>(std::istream_iterator<double>(stream), {});
  };
  EXPECT_EQ(numbers("positions").size(), 150u);
  EXPECT_EQ(numbers("scales").size(), 150u);
  EXPECT_EQ(numbers("opacities").size(), 50u);
  EXPECT_EQ(numbers("radiance:sphericalHarmonicsCoefficients").size(), 50u * 9 * 3);
  const std::vector<double> quats = numbers("orientations"), extent = numbers("extent");
  ASSERT_EQ(quats.size(), 200u);
  for (size_t g = 0; g < 50; ++g) {
    double norm = 0;
    for (size_t i = 0; i < 4; ++i) norm += quats[4 * g + i] * quats[4 * g + i];
    EXPECT_NEAR(norm, 1, 1e-6);  // of a float
  }
  for (const double scale : numbers("scales")) EXPECT_GT(scale, 0);
  for (const double opacity : numbers("opacities")) {
    EXPECT_GE(opacity, 0);
    EXPECT_LE(opacity, 1);
  }
  const std::vector<double> positions = numbers("positions");
  for (size_t i = 0; i < 150; ++i) {
    EXPECT_GT(positions[i], extent[i % 3]);
    EXPECT_LT(positions[i], extent[3 + i % 3]);
  }
}

TEST_F(UsdTest, FaultsAreNamed) {
  const auto refusal = [&](const std::string& from, const std::string& to) {
    return Refusal(
        Replaced(Stage("metersPerUnit = 1", "float xformOp:scaleX = 1", kOne), from, to));
  };
  EXPECT_THAT(refusal("ParticleField3DGaussianSplat", "Mesh"), HasSubstr("holds no Gaussians"));
  EXPECT_THAT(refusal("def Part", "over Part"), HasSubstr("holds no Gaussians"));
  EXPECT_THAT(refusal("prepend apiSchemas = [\"ColorSpaceAPI\"]", "active = false"),
              HasSubstr("that is shown"));
  EXPECT_THAT(refusal("float xformOp", "token visibility = \"invisible\"\nfloat xformOp"),
              HasSubstr("that is shown"));
  EXPECT_THAT(Refusal(Stage("subLayers = [@b.usda@]", "", "")),
              HasSubstr("refers to other layers: open the one"));
  EXPECT_THAT(refusal("Coefficients = [(1, 0, 0), ", "Coefficients = ["),
              HasSubstr("Coefficients has 3 values, not the 4 of 1 Gaussians"));
  EXPECT_THAT(refusal("[0.25]", "[0.25, 1]"), HasSubstr("opacities has 2 values, not the 1"));
  EXPECT_THAT(refusal("[0.25]", "[1.25]"), HasSubstr("Gaussian 0: opacity is not from 0 to 1"));
  EXPECT_THAT(refusal("(2, 1, 1)", "(2, -1, 1)"), HasSubstr("Gaussian 0: scale is negative"));
  EXPECT_THAT(refusal("(1, 2, 3)", "(1, nan, 3)"), HasSubstr("Gaussian 0: mean is NaN"));
  EXPECT_THAT(refusal("(1, 2, 3)", "(1, 2)"), HasSubstr("line 14: \",\" is expected"));
  EXPECT_THAT(refusal("Degree = 1", "Degree = 99"), HasSubstr("no SH degree from 0 to 16"));
  EXPECT_THAT(
      refusal("scaleX = 1", "scaleX = 2\nuniform token[] xformOpOrder = [\"xformOp:scaleX\"]"),
      HasSubstr("stretched, sheared or mirrored"));
  EXPECT_THAT(refusal("scaleX = 1",
                      "scaleX.timeSamples = {0: 1}\nuniform token[] xformOpOrder = "
                      "[\"xformOp:scaleX\"]"),
              HasSubstr("xformOp:scaleX is animated"));
  EXPECT_THAT(
      refusal("scaleX = 1", "scaleX = 1\nuniform token[] xformOpOrder = [\"xformOp:skew\"]"),
      HasSubstr("xformOp:skew is missing"));
  EXPECT_THAT(refusal("positions = [(1, 2, 3)]", "positions.timeSamples = {0: [(1, 2, 3)]}"),
              HasSubstr("positions are animated"));
  EXPECT_THAT(Refusal("#usda 1.0\n" + std::string(1 << 16, '{')), HasSubstr("a prim is expected"));
  std::string deep = "#usda 1.0\n";
  for (int i = 0; i < 3000; ++i) deep += "def \"a\" {";
  EXPECT_THAT(Refusal(deep), HasSubstr("nests them deeper"));
}

TEST_F(UsdTest, EveryTruncationIsRefused) {
  WriteSplat(folder_ / "good.usda", RandomScene(2, 1));
  WriteSplat(folder_ / "good.usdz", RandomScene(2, 1));
  for (const char* name : {"good.usda", "good.usdz"}) {
    const std::string good = ReadFile(folder_ / name);
    for (size_t length = 1; length + 2 < good.size(); length += 11) {
      SCOPED_TRACE(length);
      Refusal(good.substr(0, length), name[8] == 'a' ? "bad.usda" : "bad.usdz");
    }
  }
}

}  // namespace
}  // namespace retint
