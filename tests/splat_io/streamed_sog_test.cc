// SPDX-License-Identifier: BSD-3-Clause
// Streamed SOG: scenes put together from SOG folders and an index, read, and written with other
// colors.
#include "splat_io/streamed_sog.h"

#include <algorithm>
#include <functional>
#include <map>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "splat_io/sog_files.h"
#include "tests/splat_io/ply_text.h"
#include "tests/splat_io/random_scene.h"
#include "tests/support/folder_contents.h"

namespace retint {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using Json = nlohmann::json;

// Level 0 in two chunks of 90 and 60 Gaussians, level 1 in one of 40, and an environment of 20 of
// lower degree. The first chunk's parts are in two leaves, the second of which comes first.
Json SmallIndex() {
  return Json::parse(R"({"version": 1, "asset": {"generator": "a test"}, "count": 190,
    "counts": [150, 40], "lodLevels": 2, "environment": "env/meta.json",
    "filenames": ["0_0/meta.json", "1_0/meta.json", "0_1/meta.json"],
    "tree": {"bound": {"min": [-5, -5, -5], "max": [5, 5, 5]}, "children": [
      {"bound": {"min": [-5, -5, -5], "max": [0, 5, 5]}, "lods": {
        "0": {"file": 0, "offset": 50, "count": 40}}},
      {"bound": {"min": [0, -5, -5], "max": [5, 5, 5]}, "children": [
        {"bound": {"min": [0, -5, -5], "max": [5, 5, 5]}, "lods": {
          "0": {"file": 0, "offset": 0, "count": 50}, "1": {"file": 1, "offset": 0, "count": 40}}},
        {"bound": {"min": [0, -5, -5], "max": [5, 5, 5]}, "lods": {
          "0": {"file": 2, "offset": 0, "count": 60}}}]}]}})");
}

class StreamedSogTest : public ::testing::Test {
 protected:
  StreamedSogTest() {
    WriteSplat(scene_ / "0_0" / "meta.json", RandomScene(90, 2, 1));
    WriteSplat(scene_ / "0_1" / "meta.json", RandomScene(60, 2, 2));
    WriteSplat(scene_ / "1_0" / "meta.json", RandomScene(40, 2, 3));
    WriteSplat(scene_ / "env" / "meta.json", RandomScene(20, 0, 4));
    WriteIndex(SmallIndex());
  }
  void WriteIndex(const Json& index) { SpillFile(index_, index.dump()); }
  std::string Refusal(const std::function<void(Json&)>& spoil) {
    Json index = SmallIndex();
    spoil(index);
    WriteIndex(index);
    const std::string message = MessageOf<InputError>([&] { ReadSplat(index_); });
    EXPECT_THAT(message, AllOf(HasSubstr("lod-meta.json"), Not(HasSubstr("\n"))));
    return message;
  }

  TempFolder folder_;
  const fs::path scene_ = folder_ / "scene", index_ = scene_ / "lod-meta.json";
  const fs::path out_ = folder_ / "out" / "lod-meta.json";
};

TEST_F(StreamedSogTest, IsReadAsItsFinestLevelAndItsEnvironment) {
  const GaussianModel all = ReadSplat(index_);
  ASSERT_EQ(all.NumGaussians(), 170U);
  EXPECT_EQ(all.sh_degree, 2);
  size_t at = 0;
  for (const char* name : {"0_0", "0_1", "env"}) {
    SCOPED_TRACE(name);
    const GaussianModel part = ReadSplat(scene_ / name / "meta.json");
    const size_t width = part.sh.size() / part.NumGaussians();
    for (size_t g = 0; g < part.NumGaussians(); ++g, ++at) {
      ASSERT_TRUE(std::equal(&part.means[3 * g], &part.means[3 * g] + 3, &all.means[3 * at]));
      ASSERT_EQ(part.opacity_logits[g], all.opacity_logits[at]);
      ASSERT_TRUE(std::equal(&part.sh[width * g], &part.sh[width * g] + width, &all.sh[27 * at]));
      for (size_t i = width; i < 27; ++i) ASSERT_EQ(all.sh[27 * at + i], 0);
    }
  }
  EXPECT_EQ(NumStreamedLevels(all), 2);
  Monitor monitor;
  EXPECT_EQ(ReadStreamedLevel(all, 1, monitor).NumGaussians(), 60U);
  EXPECT_EQ(SplatFiles(index_).size(), 1 + 3 * 8 + 6U);
  // Known by its content, too.
  fs::rename(index_, scene_ / "scene.json");
  EXPECT_EQ(ReadSplat(scene_ / "scene.json").NumGaussians(), 170U);
}

TEST_F(StreamedSogTest, OlderFilesHaveNoVersionAndNoCounts) {
  Json index = SmallIndex();
  for (const char* name : {"version", "count", "counts", "asset"}) index.erase(name);
  index["environment"] = nullptr;
  WriteIndex(index);
  EXPECT_EQ(ReadSplat(index_).NumGaussians(), 150U);
}

TEST_F(StreamedSogTest, WithoutAnEditItIsACopy) {
  WriteSplat(out_, ReadSplat(index_));
  EXPECT_EQ(FolderContents(folder_ / "out"), FolderContents(scene_));
}

TEST_F(StreamedSogTest, AnEditChangesColorsOfItsChunksOnly) {
  Monitor monitor;
  std::vector<GaussianModel> levels = {ReadSplat(index_)};
  levels.push_back(ReadStreamedLevel(levels[0], 1, monitor));
  const GaussianModel before = levels[0];
  constexpr size_t kFirst = 95, kLast = 120;  // of the second chunk
  for (size_t g = kFirst; g < kLast; ++g) {
    levels[0].sh[27 * g] = 0.75F;
    levels[0].sh[27 * g + 5] = 0.125F;
  }
  levels[1].sh[27 * 7 + 1] = -0.25F;
  WriteStreamedSog(out_, levels, monitor);

  const std::map<std::string, std::string> was = FolderContents(scene_),
                                           is = FolderContents(folder_ / "out");
  ASSERT_EQ(was.size(), is.size());
  for (const auto& [name, bytes] : was) {
    SCOPED_TRACE(name);
    const bool edited = name.starts_with("0_1/") || name.starts_with("1_0/");
    const bool colors = name.find("/sh") != std::string::npos || name.ends_with("/meta.json");
    if (edited && colors) continue;
    EXPECT_EQ(is.at(name), bytes);
  }
  EXPECT_NE(was.at("0_1/sh0.webp"), is.at("0_1/sh0.webp"));
  EXPECT_NE(was.at("1_0/meta.json"), is.at("1_0/meta.json"));  // at least its table
  // All else of meta.json.
  Json meta_was = Json::parse(was.at("0_1/meta.json")),
       meta_is = Json::parse(is.at("0_1/meta.json"));
  for (const char* name : {"sh0", "shN"}) {
    meta_was.erase(name);
    meta_is.erase(name);
  }
  EXPECT_EQ(meta_was, meta_is);

  const GaussianModel after = ReadSplat(out_);
  EXPECT_EQ(after.means, before.means);
  EXPECT_EQ(after.opacity_logits, before.opacity_logits);
  // Three of 180 colors are new, and so is one of them in a table: half a step of 1/255.
  for (size_t i = 0; i < before.sh.size(); ++i) {
    ASSERT_NEAR(after.sh[i], levels[0].sh[i], 0.5 / 255 / 0.28209479) << i;
    if (i < 27 * 90 || i >= 27 * 150) {
      ASSERT_EQ(after.sh[i], before.sh[i]);
    }
  }
  const GaussianModel coarse = ReadStreamedLevel(after, 1, monitor);
  EXPECT_NEAR(coarse.sh[27 * 7 + 1], -0.25F, 0.5 / 255 / 0.28209479);
}

TEST_F(StreamedSogTest, AnEnvironmentOfLowerDegreeGetsBands) {
  Monitor monitor;
  std::vector<GaussianModel> levels = {ReadSplat(index_)};
  levels.push_back(ReadStreamedLevel(levels[0], 1, monitor));
  levels[0].sh[27 * 155 + 9] = 0.5F;
  WriteStreamedSog(out_, levels, monitor);
  EXPECT_NEAR(ReadSplat(out_).sh[27 * 155 + 9], 0.5F, 1e-6);  // one of few values of its table
  EXPECT_EQ(ReadFile(folder_ / "out" / "0_1" / "sh0.webp"), ReadFile(scene_ / "0_1" / "sh0.webp"));
}

TEST_F(StreamedSogTest, PicturesKeepTheirSize) {
  // 60 Gaussians, in 4 rows of 16 of another program.
  for (const char* name : {"means_l.webp", "means_u.webp", "quats.webp", "scales.webp", "sh0.webp",
                           "shN_labels.webp"}) {
    const fs::path file = scene_ / "0_1" / name;
    RgbaPicture picture = DecodeWebp(ReadFile(file), 60, 1000, file, name);
    picture.width = 16;
    picture.height = 4;
    picture.rgba.resize(size_t{16} * 4 * 4);
    SpillFile(file, EncodeWebp(picture));
  }
  Monitor monitor;
  std::vector<GaussianModel> levels = {ReadSplat(index_)};
  levels.push_back(ReadStreamedLevel(levels[0], 1, monitor));
  levels[0].sh[27 * 100] = 0.75F;
  WriteStreamedSog(out_, levels, monitor);
  for (const char* name : {"sh0.webp", "shN_labels.webp"}) {
    const fs::path file = folder_ / "out" / "0_1" / name;
    const RgbaPicture picture = DecodeWebp(ReadFile(file), 60, 1000, file, name);
    EXPECT_EQ(picture.width, 16) << name;
    EXPECT_EQ(picture.height, 4) << name;
  }
}

TEST_F(StreamedSogTest, IsWrittenOnlyWithItsOwnGaussians) {
  const GaussianModel all = ReadSplat(index_);
  const auto refusal = [&](const GaussianModel& model, const fs::path& path) {
    const std::string message = MessageOf<OptionError>([&] { WriteSplat(path, model); });
    EXPECT_FALSE(fs::exists(folder_ / "out"));
    return message;
  };
  EXPECT_THAT(refusal(RandomScene(5, 1), out_), HasSubstr("only with the Gaussians"));
  GaussianModel moved = all;
  moved.means[3] += 1;
  EXPECT_THAT(refusal(moved, out_), HasSubstr("only with the Gaussians"));
  GaussianModel fewer = all;
  fewer.Resize(100, 2);
  EXPECT_THAT(refusal(fewer, out_), HasSubstr("only with the Gaussians"));
  GaussianModel edited = all;
  edited.sh[3] = 0.5F;
  EXPECT_THAT(refusal(edited, out_), HasSubstr("other levels of detail"));
  const auto was = FolderContents(scene_);
  EXPECT_THAT(refusal(all, index_), HasSubstr("another folder"));
  EXPECT_EQ(FolderContents(scene_), was);
}

TEST_F(StreamedSogTest, NamesDoNotLeadOutOfTheFolder) {
  for (const char* name :
       {"../scene/0_0/meta.json", "/etc/passwd", "0_0/../../x/meta.json", "", "0_0//meta.json",
        "./0_0/meta.json", "0_0/meta.json/", "a\\b", "https://host/meta.json"}) {
    EXPECT_THAT(Refusal([&](Json& index) { index["filenames"][0] = name; }),
                HasSubstr("no file below its folder"))
        << name;
    EXPECT_THAT(Refusal([&](Json& index) { index["environment"] = name; }),
                HasSubstr("no file below its folder"))
        << name;
  }
}

TEST_F(StreamedSogTest, DamageIsNamed) {
  const auto lods = [](Json& index) -> Json& { return index["tree"]["children"][0]["lods"]; };
  EXPECT_THAT(Refusal([](Json& index) { index["version"] = 2; }), HasSubstr("of version 2"));
  EXPECT_THAT(Refusal([](Json& index) { index["lodLevels"] = 0; }), HasSubstr("no level"));
  EXPECT_THAT(Refusal([](Json& index) { index["lodLevels"] = 1e9; }), HasSubstr("no lodLevels"));
  EXPECT_THAT(Refusal([](Json& index) { index["filenames"] = 3; }), HasSubstr("names no chunk"));
  EXPECT_THAT(Refusal([](Json& index) { index["filenames"][0] = 3; }),
              HasSubstr("something else than text"));
  EXPECT_THAT(Refusal([](Json& index) { index["filenames"][2] = "0_0/meta.json"; }),
              HasSubstr("names 0_0/meta.json twice"));
  EXPECT_THAT(Refusal([](Json& index) { index["filenames"].push_back("0_7/meta.json"); }),
              HasSubstr("no part of 0_7/meta.json"));
  EXPECT_THAT(Refusal([](Json& index) { index["counts"][0] = 151; }), HasSubstr("add up"));
  EXPECT_THAT(Refusal([](Json& index) { index["counts"] = {150}; }), HasSubstr("add up"));
  EXPECT_THAT(Refusal([](Json& index) { index["count"] = uint64_t{1} << 60; }),
              HasSubstr("add up"));
  EXPECT_THAT(Refusal([](Json& index) { index.erase("tree"); }), HasSubstr("neither children"));
  EXPECT_THAT(Refusal([&](Json& index) { lods(index)["0"]["file"] = 3; }),
              HasSubstr("no file in its tree from 0 to 2"));
  EXPECT_THAT(Refusal([&](Json& index) { lods(index)["0"]["offset"] = 49; }),
              HasSubstr("overlap or leave a gap"));
  EXPECT_THAT(Refusal([&](Json& index) { lods(index)["0"]["count"] = ~uint64_t{0}; }),
              HasSubstr("no count in its tree"));
  EXPECT_THAT(Refusal([&](Json& index) { lods(index)["0"]["count"] = -1; }),
              HasSubstr("no count in its tree"));
  EXPECT_THAT(Refusal([&](Json& index) { lods(index)["2"] = lods(index)["0"]; }),
              HasSubstr("a level that is not 0 to 1"));
  EXPECT_THAT(Refusal([&](Json& index) { lods(index)["1"] = lods(index)["0"]; }),
              HasSubstr("in two levels"));
  // Counts that agree with each other, not with the chunk.
  EXPECT_THAT(Refusal([&](Json& index) {
                lods(index)["0"]["count"] = 41;
                index["counts"][0] = 151;
                index["count"] = 191;
              }),
              HasSubstr("gives 0_0/meta.json 91 Gaussians; it holds 90"));
  Json index = SmallIndex();
  index["filenames"][0] = "0_9/meta.json";
  WriteIndex(index);
  EXPECT_THAT(MessageOf<InputError>([&] { ReadSplat(index_); }),
              AllOf(HasSubstr("0_9/meta.json"), HasSubstr("No such file")));
  const std::string text = SmallIndex().dump();
  for (size_t bytes = 0; bytes < text.size(); bytes += 7) {
    SpillFile(index_, text.substr(0, bytes));
    EXPECT_THROW(ReadSplat(index_), InputError) << bytes;
  }
  std::string deep = R"({"lodLevels": 1, "filenames": ["0_0/meta.json"], "tree": )";
  for (int i = 0; i < 100'000; ++i) deep += R"({"children":[)";
  SpillFile(index_, deep);
  EXPECT_THAT(MessageOf<InputError>([&] { ReadSplat(index_); }), HasSubstr("too much JSON"));
}

}  // namespace
}  // namespace retint
