// SPDX-License-Identifier: BSD-3-Clause
// SOG version 2, put together picture by picture, apart from the codec that it tests.
#include <cmath>
#include <functional>
#include <map>
#include <random>

#include <gmock/gmock.h>
#include <webp/encode.h>
#include <zip.h>

#include <nlohmann/json.hpp>

#include "splat_io/splat_io.h"
#include "tests/splat_io/ply_text.h"

namespace retint {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using Json = nlohmann::json;

using Pixel = std::array<uint8_t, 4>;

std::string Webp(int width, int height, const std::vector<Pixel>& pixels) {
  std::vector<uint8_t> rgba;
  for (const Pixel& pixel : pixels) rgba.insert(rgba.end(), pixel.begin(), pixel.end());
  rgba.resize(size_t(width * height) * 4, 255);
  uint8_t* out = nullptr;
  const size_t bytes = WebPEncodeLosslessRGBA(rgba.data(), width, height, width * 4, &out);
  std::string webp(reinterpret_cast<char*>(out), bytes);
  WebPFree(out);
  return webp;
}

// Two Gaussians of SH degree 1.
struct Sog {
  Json meta = Json::parse(R"({"version": 2, "count": 2,
    "means": {"mins": [0, -1, -2], "maxs": [1, 1, 2], "files": ["means_l.webp", "means_u.webp"]},
    "scales": {"files": ["scales.webp"]},
    "quats": {"files": ["quats.webp"]},
    "sh0": {"files": ["sh0.webp"]},
    "shN": {"count": 65, "bands": 1, "files": ["shN_centroids.webp", "shN_labels.webp"]}})");
  std::map<std::string, std::string> files;

  Sog() {
    std::vector<double> scales, colors, bands;
    for (int i = 0; i < 256; ++i) {
      scales.push_back(-10 + i / 32.0);
      colors.push_back(-2 + i / 64.0);
      bands.push_back(-0.5 + i / 256.0);
    }
    meta["scales"]["codebook"] = scales;
    meta["sh0"]["codebook"] = colors;
    meta["shN"]["codebook"] = bands;
    files["means_l.webp"] = Webp(4, 4, {{255, 0, 0, 255}, {0, 1, 0, 255}});
    files["means_u.webp"] = Webp(4, 4, {{255, 0, 128, 255}, {0, 0, 64, 255}});
    files["scales.webp"] = Webp(4, 4, {{0, 32, 255, 255}, {1, 2, 3, 255}});
    files["quats.webp"] = Webp(4, 4, {{128, 127, 255, 252}, {0, 128, 127, 255}});
    files["sh0.webp"] = Webp(4, 4, {{0, 128, 255, 51}, {64, 64, 64, 255}});
    // 64 sets of three coefficients a row; the 65th begins the second row.
    std::vector<Pixel> centroids(192 * 2, Pixel{0, 0, 0, 255});
    centroids[3] = {1, 2, 3, 255};
    centroids[4] = {4, 5, 6, 255};
    centroids[5] = {7, 8, 9, 255};
    centroids[192] = {128, 129, 130, 255};
    files["shN_centroids.webp"] = Webp(192, 2, centroids);
    files["shN_labels.webp"] = Webp(4, 4, {{1, 0, 0, 255}, {64, 0, 0, 255}});
  }

  void WriteFolder(const std::filesystem::path& folder) const {
    std::filesystem::create_directories(folder);
    for (const auto& [name, bytes] : files) SpillFile(folder / name, bytes);
    SpillFile(folder / "meta.json", meta.dump());
  }
  void WriteBundle(const std::filesystem::path& path, int method = ZIP_CM_STORE) const {
    std::map<std::string, std::string> all = files;
    all["meta.json"] = meta.dump();
    std::filesystem::remove(path);
    zip_t* zip = zip_open(path.c_str(), ZIP_CREATE, nullptr);
    for (const auto& [name, bytes] : all) {
      zip_source_t* source = zip_source_buffer(zip, bytes.data(), bytes.size(), 0);
      const zip_int64_t index = zip_file_add(zip, name.c_str(), source, ZIP_FL_ENC_UTF_8);
      zip_set_file_compression(zip, zip_uint64_t(index), method, 0);
    }
    zip_close(zip);
  }
};

class SogTest : public ::testing::Test {
 protected:
  std::string Refusal(const std::filesystem::path& path) {
    const std::string message = MessageOf<InputError>([&] { ReadSplat(path); });
    EXPECT_THAT(message, AllOf(HasSubstr(path.parent_path().string()), Not(HasSubstr("\n"))));
    return message;
  }
  std::string Refusal(const std::function<void(Sog&)>& spoil) {
    Sog sog;
    spoil(sog);
    sog.WriteBundle(folder_ / "bad.sog");
    return Refusal(folder_ / "bad.sog");
  }
  TempFolder folder_;
};

void ExpectScene(const GaussianModel& model) {
  ASSERT_EQ(model.NumGaussians(), 2u);
  ASSERT_EQ(model.sh_degree, 1);
  const auto mean = [](double n) { return std::copysign(std::exp(std::abs(n)) - 1, n); };
  // Floats of numbers up to 6: 1e-6.
  EXPECT_NEAR(model.means[0], mean(1), 1e-6);
  EXPECT_NEAR(model.means[1], mean(-1), 1e-6);
  EXPECT_NEAR(model.means[2], mean(-2 + 4 * 32768 / 65535.0), 1e-6);
  EXPECT_NEAR(model.means[3], 0, 1e-6);
  EXPECT_NEAR(model.means[4], mean(-1 + 2 / 65535.0), 1e-6);
  EXPECT_NEAR(model.means[5], mean(-2 + 4 * 16384 / 65535.0), 1e-6);
  EXPECT_THAT(model.log_scales,
              ::testing::ElementsAre(-10.0f, -9.0f, -10 + 255 / 32.0f, -10 + 1 / 32.0f,
                                     -10 + 2 / 32.0f, -10 + 3 / 32.0f));
  // w is the largest: it follows from x, y, z = (1, -1, 255) / 255 / sqrt(2).
  const double a = 1 / 255.0 * std::sqrt(0.5), c = std::sqrt(0.5);
  EXPECT_NEAR(model.quats_wxyz[1], a, 1e-6);
  EXPECT_NEAR(model.quats_wxyz[2], -a, 1e-6);
  EXPECT_NEAR(model.quats_wxyz[3], c, 1e-6);
  EXPECT_NEAR(model.quats_wxyz[0], std::sqrt(1 - 2 * a * a - c * c), 1e-6);
  // z is the largest of the other.
  EXPECT_NEAR(model.quats_wxyz[4], -c, 1e-6);
  EXPECT_NEAR(model.quats_wxyz[7], std::sqrt(1 - 2 * a * a - c * c), 1e-6);
  EXPECT_NEAR(1 / (1 + std::exp(-double(model.opacity_logits[0]))), 51 / 255.0, 1e-6);
  const auto band = [](int i) { return -0.5f + static_cast<float>(i) / 256; };
  const FloatArray expected = {
      -2,        0,         -2 + 255 / 64.0f, band(1), band(2), band(3), band(4), band(5),
      band(6),   band(7),   band(8),          band(9), -1,      -1,      -1,      band(128),
      band(129), band(130), band(0),          band(0), band(0), band(0), band(0), band(0)};
  EXPECT_EQ(model.sh, expected);
}

TEST_F(SogTest, BundlesAndFoldersAreRead) {
  const Sog sog;
  sog.WriteBundle(folder_ / "a.sog");
  ExpectScene(ReadSplat(folder_ / "a.sog"));
  sog.WriteBundle(folder_ / "renamed.zip", ZIP_CM_DEFLATE);
  ExpectScene(ReadSplat(folder_ / "renamed.zip"));
  sog.WriteFolder(folder_ / "scene");
  ExpectScene(ReadSplat(folder_ / "scene" / "meta.json"));
}

TEST_F(SogTest, AnotherProgramsBundleIsRead) {
  RETINT_REQUIRE_DATA("splats/angel.sog");
  const GaussianModel model = ReadSplat(DataPath("splats/angel.sog"));
  EXPECT_EQ(model.NumGaussians(), 71359u);
  EXPECT_EQ(model.sh_degree, 0);
  float least = 0, most = 0;
  for (size_t i = 1; i < model.means.size(); i += 3) {
    least = std::min(least, model.means[i]);
    most = std::max(most, model.means[i]);
  }
  // The bounds of y in its meta.json, as logarithms; both are reached but for a step of 2.1 /
  // 65535, which is 9e-5 there.
  EXPECT_NEAR(least, -(std::exp(1.1320216) - 1), 1e-4);
  EXPECT_NEAR(most, std::exp(0.9813033) - 1, 1e-4);
}

TEST_F(SogTest, FaultsAreNamed) {
  EXPECT_THAT(Refusal([](Sog& s) { s.meta["version"] = 3; }), HasSubstr("SOG version 3"));
  EXPECT_THAT(Refusal([](Sog& s) { s.meta.erase("version"); }), HasSubstr("SOG version 1"));
  EXPECT_THAT(Refusal([](Sog& s) { s.meta["count"] = 0; }), HasSubstr("no Gaussians"));
  EXPECT_THAT(Refusal([](Sog& s) { s.meta["count"] = 17; }),
              HasSubstr("means_l.webp has 16 pixels, expected 17"));
  EXPECT_THAT(Refusal([](Sog& s) { s.meta["count"] = 4000000000u; }),
              HasSubstr("has no count from 0 to"));
  EXPECT_THAT(Refusal([](Sog& s) { s.meta["count"] = "two"; }), HasSubstr("has no count"));
  EXPECT_THAT(Refusal([](Sog& s) { s.meta.erase("quats"); }), HasSubstr("lacks quats"));
  EXPECT_THAT(Refusal([](Sog& s) {
                s.meta["means"]["mins"] = Json::array({1, 2});
              }),
              HasSubstr("no list of 3 numbers where mins"));
  EXPECT_THAT(Refusal([](Sog& s) { s.meta["sh0"]["codebook"][3] = nullptr; }),
              HasSubstr("no list of 256 numbers where codebook"));
  EXPECT_THAT(Refusal([](Sog& s) { s.meta["means"]["mins"][1] = 1e39; }),
              HasSubstr("Gaussian 0: mean is"));
  EXPECT_THAT(Refusal([](Sog& s) { s.meta["quats"]["files"][0] = "../quats.webp"; }),
              HasSubstr("no plain file name"));
  EXPECT_THAT(Refusal([](Sog& s) { s.files.erase("scales.webp"); }),
              HasSubstr("the bundle lacks scales.webp"));
  EXPECT_THAT(Refusal([](Sog& s) { s.files["sh0.webp"].resize(30); }), HasSubstr("sh0.webp"));
  EXPECT_THAT(Refusal([](Sog& s) {
                s.files["quats.webp"] = Webp(4, 4, {{0, 0, 0, 252}, {1, 2, 3, 251}});
              }),
              HasSubstr("Gaussian 1: rotation is marked 251"));
  EXPECT_THAT(Refusal([](Sog& s) { s.meta["shN"]["count"] = 64; }),
              HasSubstr("Gaussian 1: spherical harmonics are set 64 of 64"));
  EXPECT_THAT(Refusal([](Sog& s) { s.meta["shN"]["bands"] = 4; }), HasSubstr("no bands from"));
  EXPECT_THAT(Refusal([](Sog& s) { s.meta["shN"]["bands"] = 2; }),
              HasSubstr("shN_centroids.webp has 384 pixels"));
}

TEST_F(SogTest, LossyPicturesAreRefused) {
  Sog sog;
  std::vector<uint8_t> rgba(16 * 4, 99);
  uint8_t* out = nullptr;
  const size_t bytes = WebPEncodeRGBA(rgba.data(), 4, 4, 16, 90, &out);
  sog.files["scales.webp"].assign(reinterpret_cast<char*>(out), bytes);
  WebPFree(out);
  sog.WriteBundle(folder_ / "bad.sog");
  EXPECT_THAT(Refusal(folder_ / "bad.sog"), HasSubstr("scales.webp is not a lossless"));
}

// A picture of one color packs to nearly nothing, whatever its size.
TEST_F(SogTest, BombsAreRefused) {
  EXPECT_THAT(Refusal([](Sog& s) {
                s.files["means_l.webp"] = Webp(1000, 1000, {});
                ASSERT_LT(s.files["means_l.webp"].size(), 4096u);
              }),
              HasSubstr("means_l.webp has 1000000 pixels"));
  Sog sog;
  sog.files["means_l.webp"] = std::string(64 << 20, '\0');
  sog.WriteBundle(folder_ / "bad.sog", ZIP_CM_DEFLATE);
  EXPECT_THAT(Refusal(folder_ / "bad.sog"), HasSubstr("more than the bundle can hold"));
  // The other files do not make room for it.
  std::string& ballast = sog.files["z_ballast.bin"];
  std::minstd_rand random(1);
  for (size_t i = 0; i < (1 << 20); ++i) ballast += static_cast<char>(random());
  sog.WriteBundle(folder_ / "bad.sog", ZIP_CM_DEFLATE);
  EXPECT_THAT(Refusal(folder_ / "bad.sog"),
              HasSubstr("means_l.webp announces 67108864 bytes, more than the bundle can hold"));
}

TEST_F(SogTest, EveryTruncationAndDamageIsRefusedOrHarmless) {
  Sog().WriteBundle(folder_ / "good.sog");
  const std::string good = ReadFile(folder_ / "good.sog");
  for (size_t length = 0; length < good.size(); length += 11) {
    SCOPED_TRACE(length);
    SpillFile(folder_ / "bad.sog", good.substr(0, length));
    Refusal(folder_ / "bad.sog");
  }
  std::mt19937 random(1);
  for (int i = 0; i < 500; ++i) {
    std::string bytes = good;
    for (int flips = 1 + i % 3; flips > 0; --flips) {
      bytes[random() % bytes.size()] = static_cast<char>(random());
    }
    SpillFile(folder_ / "bad.sog", bytes);
    try {
      const GaussianModel model = ReadSplat(folder_ / "bad.sog");
      EXPECT_NO_THROW(model.Validate());
    } catch (const InputError& error) {
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    }
  }
}

}  // namespace
}  // namespace retint
