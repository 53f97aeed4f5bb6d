// SPDX-License-Identifier: BSD-3-Clause
// glTF with KHR_gaussian_splatting.
#include <functional>
#include <random>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "base/base64.h"
#include "splat_io/gltf_file.h"
#include "splat_io/splat_io.h"
#include "tests/splat_io/ply_text.h"
#include "tests/splat_io/random_scene.h"

namespace retint {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using Json = nlohmann::json;

// Floats throughout: 1e-6 for rotations that are normalized, 2e-6 for scales through expf and logf,
// 1e-6 for opacities, which lie in [0, 1].
constexpr Rounding kRounding = {0, 2e-6, 1e-6, 0, 0, 1e-6};

class GltfTest : public ::testing::Test {
 protected:
  // The document of a scene written as .gltf, whose buffer stands in it.
  Json Document(const GaussianModel& model) {
    WriteSplat(folder_ / "good.gltf", model);
    return Json::parse(ReadFile(folder_ / "good.gltf"));
  }
  GaussianModel Read(const Json& document) {
    SpillFile(folder_ / "in.gltf", document.dump());
    return ReadSplat(folder_ / "in.gltf");
  }
  std::string Refusal(const std::string& name, const std::string& bytes) {
    SpillFile(folder_ / name, bytes);
    const std::string message = MessageOf<InputError>([&] { ReadSplat(folder_ / name); });
    EXPECT_THAT(message, AllOf(HasSubstr((folder_ / name).string() + ":"), Not(HasSubstr("\n"))));
    return message;
  }
  std::string Refusal(const Json& document) { return Refusal("bad.gltf", document.dump()); }
  TempFolder folder_;
};

TEST_F(GltfTest, RoundTripsAsTextAndAsBinary) {
  for (int degree = 0; degree <= 3; ++degree) {
    const GaussianModel model = RandomScene(9000, degree);  // more than a block
    for (const char* name : {"a.glb", "a.gltf"}) {
      SCOPED_TRACE(std::string(name) + " " + std::to_string(degree));
      WriteSplat(folder_ / name, model);
      const GaussianModel back = ReadSplat(folder_ / name);
      EXPECT_EQ(back.sh_degree, degree);
      EXPECT_THAT(back.source.notes, ElementsAre());
      ExpectNear(model, back, kRounding);
      EXPECT_EQ(SplatBytes(folder_ / name), std::filesystem::file_size(folder_ / name));
    }
  }
}

TEST_F(GltfTest, IsLeftUpFrontWithLinearScales) {
  const GaussianModel model = RandomScene(1, 0);
  WriteSplat(folder_ / "a.glb", model);
  const GltfFile file(folder_ / "a.glb");
  const Json& primitive = file.json()["meshes"][0]["primitives"][0];
  const auto values = [&](const std::string& attribute) {
    const GltfValues view = file.View(primitive["attributes"][attribute].get<uint64_t>(), 3);
    std::vector<float> numbers(3 * view.count);
    std::vector<char> room;
    view.Load<3>(0, view.count, numbers.data(), 3, room);
    return numbers;
  };
  EXPECT_THAT(values("POSITION"), ElementsAre(-model.means[0], -model.means[1], model.means[2]));
  EXPECT_FLOAT_EQ(values("KHR_gaussian_splatting:SCALE")[1], std::exp(model.log_scales[1]));
  // The color of points is linear, the Gaussian's is of sRGB.
  const GltfValues color = file.View(primitive["attributes"]["COLOR_0"].get<uint64_t>(), 4);
  float rgba[4];
  std::vector<char> bytes;
  color.Load<4>(0, 1, rgba, 4, bytes);
  for (size_t i = 0; i < 3; ++i) {
    const double srgb = 0.5 + 0.28209479 * model.sh[i];
    const double linear = srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4);
    EXPECT_NEAR(rgba[i], linear, 0.5 / 255 + 1e-6);  // half a byte's step
  }
  EXPECT_EQ(primitive["mode"], 0);
  EXPECT_EQ(file.json()["extensionsUsed"], Json::array({"KHR_gaussian_splatting"}));
  const Json& position = file.json()["accessors"][0];
  EXPECT_EQ(position["min"], position["max"]);
  EXPECT_EQ(position["min"][0], -model.means[0]);
}

// The scene in a node of every kind of transform against the transform applied to the Gaussians:
// their covariances and their colors towards turned directions.
TEST_F(GltfTest, NodesMoveTheirGaussians) {
  const GaussianModel model = RandomScene(5, 3);
  Json document = Document(model);
  // A quarter turn about z in glTF's axes, x left, y up: (x, y) to (-y, x). Twice as large, moved.
  const double half = std::sqrt(0.5);
  document["nodes"] = Json::parse(R"([{"children": [1], "translation": [1, 2, 3]},
                                      {"scale": [2, 2, 2], "mesh": 0}])");
  document["nodes"][1]["rotation"] = Json::array({0, 0, half, half});
  const GaussianModel moved = Read(document);
  ASSERT_EQ(moved.NumGaussians(), 5u);
  for (size_t g = 0; g < 5; ++g) {
    const float* x = &model.means[3 * g];
    // In the .ply's axes: x right, y down, so that the same turn leads (x, y) to (-y, x) too.
    EXPECT_NEAR(moved.means[3 * g], -2 * x[1] - 1, 1e-5);
    EXPECT_NEAR(moved.means[3 * g + 1], 2 * x[0] - 2, 1e-5);
    EXPECT_NEAR(moved.means[3 * g + 2], 2 * x[2] + 3, 1e-5);
    for (size_t i = 0; i < 3; ++i) {
      EXPECT_NEAR(moved.log_scales[3 * g + i], model.log_scales[3 * g + i] + std::log(2), 1e-5);
    }
    // q = (half, 0, 0, half) times the Gaussian's own.
    const float* q = &model.quats_wxyz[4 * g];
    const double norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    const double expected[] = {half * (q[0] - q[3]), half * (q[1] - q[2]), half * (q[2] + q[1]),
                               half * (q[3] + q[0])};
    const float* r = &moved.quats_wxyz[4 * g];
    double dot = 0;
    for (size_t i = 0; i < 4; ++i) dot += r[i] * expected[i] / norm;
    EXPECT_NEAR(std::abs(dot), 1, 1e-5);
    // Degree 1: -y, z, -x of the direction. f'(R d) = f(d): y' = x and x' = -y.
    const float *sh = &model.sh[48 * g], *turned = &moved.sh[48 * g];
    for (size_t c = 0; c < 3; ++c) {
      EXPECT_NEAR(turned[c], sh[c], 1e-6);
      EXPECT_NEAR(turned[3 + c], sh[9 + c], 1e-6);   // of -y' = -x
      EXPECT_NEAR(turned[6 + c], sh[6 + c], 1e-6);   // of z
      EXPECT_NEAR(turned[9 + c], -sh[3 + c], 1e-6);  // of -x' = y
    }
  }
}

TEST_F(GltfTest, PrimitivesOfAllShownNodesAreReadInTurn) {
  const GaussianModel model = RandomScene(5, 1);
  Json document = Document(model);
  Json& primitives = document["meshes"][0]["primitives"];
  primitives.push_back(primitives[0]);
  for (int n = 0; n < 3; ++n) {  // the second one has degree 0
    primitives[1]["attributes"].erase("KHR_gaussian_splatting:SH_DEGREE_1_COEF_" +
                                      std::to_string(n));
  }
  primitives.push_back({{"mode", 4}, {"attributes", {{"POSITION", 0}}}});
  const GaussianModel both = Read(document);
  ASSERT_EQ(both.NumGaussians(), 10u);
  EXPECT_EQ(both.sh_degree, 1);
  for (size_t i = 0; i < 15; ++i) EXPECT_EQ(both.means[15 + i], model.means[i]);
  EXPECT_EQ(both.sh[5 * 12 + 2], model.sh[2]);
  EXPECT_EQ(both.sh[5 * 12 + 5], 0);
  EXPECT_THAT(both.source.notes, ElementsAre("meshes other than Gaussians are not used"));
}

// The extension ends at degree 3; a file that goes on is read as far, and says so.
TEST_F(GltfTest, DegreeFourIsNotUsed) {
  const GaussianModel model = RandomScene(4, 3);
  Json document = Document(model);
  Json& attributes = document["meshes"][0]["primitives"][0]["attributes"];
  for (int n = 0; n < 9; ++n) {
    attributes["KHR_gaussian_splatting:SH_DEGREE_4_COEF_" + std::to_string(n)] =
        attributes["KHR_gaussian_splatting:SH_DEGREE_3_COEF_0"];
  }
  const GaussianModel read = Read(document);
  EXPECT_EQ(read.sh_degree, 3);
  EXPECT_EQ(read.sh, model.sh);
  EXPECT_TRUE(read.source.extras.empty());
  EXPECT_THAT(read.source.notes,
              ElementsAre("spherical harmonics of degree 4 are not used: KHR_gaussian_splatting "
                          "ends at 3"));
}

TEST_F(GltfTest, QuantizedAttributesAndLogarithmsOfADraftAreRead) {
  const GaussianModel model = RandomScene(1, 0);
  Json document = Document(model);
  std::string bytes = std::string("\x40\xC0\x00\x81", 4) + std::string("\x80\x01\x02\x03", 4) +
                      PlyText::Raw(-3.0f) + PlyText::Raw(-4.0f) + PlyText::Raw(1.0f);
  Base64Encoder encoder;
  std::string text = encoder.Add(bytes);
  text += encoder.Finish();
  document["buffers"].push_back(
      {{"byteLength", bytes.size()}, {"uri", "data:application/gltf-buffer;base64," + text}});
  const size_t view = document["bufferViews"].size(), first = document["accessors"].size();
  document["bufferViews"].push_back({{"buffer", 1}, {"byteLength", bytes.size()}});
  const auto add = [&](size_t offset, int component, const char* type, bool normalized) {
    document["accessors"].push_back({{"bufferView", view},
                                     {"byteOffset", offset},
                                     {"componentType", component},
                                     {"normalized", normalized},
                                     {"type", type},
                                     {"count", 1}});
  };
  add(0, 5120, "VEC4", true);
  add(4, 5121, "SCALAR", true);
  add(8, 5126, "VEC3", false);
  Json& attributes = document["meshes"][0]["primitives"][0]["attributes"];
  attributes["KHR_gaussian_splatting:ROTATION"] = first;
  attributes["KHR_gaussian_splatting:OPACITY"] = first + 1;
  attributes["KHR_gaussian_splatting:SCALE"] = first + 2;
  const GaussianModel read = Read(document);
  // xyzw = (64, -64, 0, -127) / 127 in left-up-front; x and y change sign, z and w do not.
  EXPECT_THAT(read.quats_wxyz, ElementsAre(-1, ::testing::FloatEq(-64 / 127.0f),
                                           ::testing::FloatEq(64 / 127.0f), 0));
  EXPECT_NEAR(1 / (1 + std::exp(-double(read.opacity_logits[0]))), 128 / 255.0, 1e-6);
  EXPECT_THAT(read.log_scales, ElementsAre(-3, -4, 1));
  ASSERT_EQ(read.source.notes.size(), 1u);
  EXPECT_THAT(read.source.notes[0], HasSubstr("logarithms"));
}

TEST_F(GltfTest, BuffersBesideTheFileAreRead) {
  const GaussianModel model = RandomScene(3, 0);
  Json document = Document(model);
  std::string text = document["buffers"][0]["uri"], bytes;
  ASSERT_TRUE(DecodeBase64(std::string_view(text).substr(text.find(',') + 1), bytes));
  SpillFile(folder_ / "my data.bin", bytes);
  document["buffers"][0]["uri"] = "my%20data.bin";
  ExpectNear(model, Read(document), kRounding);
  EXPECT_EQ(SplatBytes(folder_ / "in.gltf"), document.dump().size() + bytes.size());
  SpillFile(folder_ / "my data.bin", bytes.substr(1));
  EXPECT_THAT(Refusal(document), HasSubstr("truncated: buffer 0 announces"));
  document["buffers"][0]["uri"] = "../secret.bin";
  EXPECT_THAT(Refusal(document), HasSubstr("outside of its folder"));
  document["buffers"][0]["uri"] = "http://example.org/a.bin";
  EXPECT_THAT(Refusal(document), HasSubstr("outside of its folder"));
}

// As other programs lay it out: a Gaussian's values side by side.
TEST_F(GltfTest, InterleavedValuesAreRead) {
  const GaussianModel model = RandomScene(5000, 1);  // more than are read at a time
  Json document = Document(model);
  std::string text = document["buffers"][0]["uri"], bytes;
  ASSERT_TRUE(DecodeBase64(std::string_view(text).substr(text.find(',') + 1), bytes));
  const size_t count = model.NumGaussians(), row = bytes.size() / count;
  std::string rows(bytes.size(), '\0');
  size_t column = 0;
  for (Json& accessor : document["accessors"]) {
    const Json& view = document["bufferViews"][accessor["bufferView"].get<size_t>()];
    const size_t at = view["byteOffset"], width = view["byteLength"].get<size_t>() / count;
    for (size_t g = 0; g < count; ++g) {
      bytes.copy(rows.data() + g * row + column, width, at + g * width);
    }
    accessor["bufferView"] = 0;
    accessor["byteOffset"] = column;
    column += width;
  }
  document["bufferViews"] =
      Json::array({{{"buffer", 0}, {"byteLength", rows.size()}, {"byteStride", row}}});
  document["buffers"][0]["uri"] = "rows.bin";
  SpillFile(folder_ / "rows.bin", rows);
  ExpectNear(model, Read(document), kRounding);
}

TEST_F(GltfTest, FaultsAreNamed) {
  const Json good = Document(RandomScene(3, 1));
  const auto refusal = [&](const std::function<void(Json & document, Json & primitive)>& spoil) {
    Json document = good;
    spoil(document, document["meshes"][0]["primitives"][0]);
    return Refusal(document);
  };
  EXPECT_THAT(refusal([](Json&, Json& p) { p.erase("extensions"); }), HasSubstr("no Gaussians"));
  EXPECT_THAT(refusal([](Json&, Json& p) {
                p["extensions"]["KHR_gaussian_splatting"]["extensions"]["KHR_spz"] = 1;
              }),
              HasSubstr("stored by KHR_spz, which is not supported"));
  EXPECT_THAT(
      refusal([](Json&, Json& p) { p["attributes"].erase("KHR_gaussian_splatting:OPACITY"); }),
      HasSubstr("lacks the attribute KHR_gaussian_splatting:OPACITY"));
  EXPECT_THAT(refusal([](Json&, Json& p) { p["attributes"]["POSITION"] = 99; }),
              HasSubstr("lacks number 99 of its accessors"));
  EXPECT_THAT(refusal([](Json&, Json& p) { p["attributes"]["POSITION"] = -1; }),
              HasSubstr("POSITION is not a whole number"));
  EXPECT_THAT(refusal([](Json& d, Json&) { d["accessors"][0]["count"] = 4000000000u; }),
              HasSubstr("more Gaussians than its"));
  EXPECT_THAT(refusal([](Json& d, Json&) { d["accessors"][0]["count"] = 4; }),
              HasSubstr("does not fit into its buffer"));
  EXPECT_THAT(refusal([](Json& d, Json&) { d["accessors"][4]["count"] = 2; }),
              HasSubstr("has not one value a position"));
  EXPECT_THAT(refusal([](Json& d, Json&) { d["accessors"][0]["byteOffset"] = UINT64_MAX; }),
              HasSubstr("does not fit into its buffer"));
  EXPECT_THAT(refusal([](Json& d, Json&) { d["bufferViews"][0]["byteStride"] = 4; }),
              HasSubstr("does not fit into its buffer"));
  EXPECT_THAT(refusal([](Json& d, Json&) { d["accessors"][0]["type"] = "VEC2"; }),
              HasSubstr("accessor 0 is not of type VEC3"));
  EXPECT_THAT(refusal([](Json& d, Json&) { d["accessors"][0]["sparse"] = 1; }),
              HasSubstr("is sparse"));
  EXPECT_THAT(refusal([](Json& d, Json&) { d["accessors"][0].erase("bufferView"); }),
              HasSubstr("has no data"));
  EXPECT_THAT(refusal([](Json& d, Json&) { d["nodes"][0]["children"] = Json::array({0}); }),
              HasSubstr("nodes are no tree"));
  EXPECT_THAT(refusal([](Json& d, Json&) {
                d["nodes"][0]["scale"] = Json::array({1, 2, 1});
              }),
              HasSubstr("stretches or mirrors"));
  EXPECT_THAT(refusal([](Json& d, Json&) {
                d["nodes"][0]["scale"] = Json::array({-1, -1, -1});
              }),
              HasSubstr("stretches or mirrors"));
  EXPECT_THAT(refusal([](Json& d, Json&) {
                d["nodes"][0]["matrix"] = Json::array({1, 2});
              }),
              HasSubstr("matrix is not a list of 16 numbers"));
  EXPECT_THAT(refusal([](Json& d, Json&) {
                d["buffers"][0]["uri"] = "data:application/octet-stream;base64,AA?A";
              }),
              HasSubstr("not base64"));
  EXPECT_THAT(refusal([](Json& d, Json&) { d["buffers"][0]["byteLength"] = 99999; }),
              HasSubstr("truncated: buffer 0"));
}

TEST_F(GltfTest, DeepOrVastJsonIsRefused) {
  EXPECT_THAT(Refusal("bad.gltf", "{\"nodes\":" + std::string(1 << 20, '[')),
              HasSubstr("too much JSON"));
  std::string many = "{\"nodes\":[0";
  for (int i = 0; i < (1 << 21); ++i) many += ",0";
  EXPECT_THAT(Refusal("bad.gltf", many + "]}"), HasSubstr("too much JSON"));
}

TEST_F(GltfTest, BadValuesAreNamed) {
  WriteSplat(folder_ / "good.glb", RandomScene(3, 0));
  const std::string good = ReadFile(folder_ / "good.glb");
  const size_t body = good.size() - 3 * (12 + 4 + 16 + 12 + 4 + 12);
  const auto with = [&](size_t at, float value) {
    std::string bytes = good;
    return Refusal("bad.glb", bytes.replace(body + at, 4, PlyText::Raw(value)));
  };
  EXPECT_THAT(with(12, NAN), HasSubstr("Gaussian 1: mean is NaN"));
  EXPECT_THAT(with(3 * (12 + 4 + 16 + 12) + 8, 1.5f), HasSubstr("Gaussian 2: opacity is not from"));
  EXPECT_THAT(with(3 * (12 + 4 + 16) + 4, INFINITY), HasSubstr("Gaussian 0: scale is infinite"));
}

TEST_F(GltfTest, EveryTruncationIsRefused) {
  WriteSplat(folder_ / "good.glb", RandomScene(1, 0));
  const std::string good = ReadFile(folder_ / "good.glb");
  for (size_t length = 0; length < good.size(); ++length) {
    SCOPED_TRACE(length);
    Refusal("bad.glb", good.substr(0, length));
  }
}

TEST_F(GltfTest, BytesAfterItsEndAreIgnored) {
  WriteSplat(folder_ / "good.glb", RandomScene(4, 0));
  WriteFile(folder_ / "more.glb", ReadFile(folder_ / "good.glb") + "xyz");
  const GaussianModel model = ReadSplat(folder_ / "more.glb");
  EXPECT_EQ(model.means, ReadSplat(folder_ / "good.glb").means);
  EXPECT_THAT(model.source.notes,
              testing::ElementsAre(HasSubstr("3 bytes after the end of the glTF are ignored")));
}

TEST_F(GltfTest, DamagedBytesNeverCrash) {
  WriteSplat(folder_ / "good.glb", RandomScene(2, 1));
  const std::string good = ReadFile(folder_ / "good.glb");
  std::mt19937 random(1);
  for (int i = 0; i < 1500; ++i) {
    std::string bytes = good;
    for (int flips = 1 + i % 3; flips > 0; --flips) {
      bytes[random() % bytes.size()] = static_cast<char>(random());
    }
    SpillFile(folder_ / "bad.glb", bytes);
    try {
      const GaussianModel model = ReadSplat(folder_ / "bad.glb");
      EXPECT_NO_THROW(model.Validate());
    } catch (const InputError& error) {
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    }
  }
}

}  // namespace
}  // namespace retint
