// SPDX-License-Identifier: BSD-3-Clause
// How a splat was trained and the space of its colors, through every format.
#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "splat_io/splat_io.h"
#include "tests/splat_io/ply_text.h"
#include "tests/splat_io/random_scene.h"

namespace retint {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

GaussianModel Tagged(RenderModel render_model, ColorSpace space = ColorSpace::kSrgbDisplay) {
  GaussianModel model = RandomScene(40, 1);
  model.traits.render_model = render_model;
  model.traits.color_space = space;
  return model;
}

// The header of a .ply, with one comment.
GaussianModel WithComment(const TempFolder& folder, const std::string& comment) {
  WriteSplat(folder / "plain.ply", RandomScene(3, 0));
  std::string bytes = ReadFile(folder / "plain.ply");
  bytes.insert(bytes.find("element"), "comment " + comment + "\n");
  SpillFile(folder / "tagged.ply", bytes);
  return ReadSplat(folder / "tagged.ply");
}

TEST(SplatTags, CommentsOfAllTrainersAreRead) {
  TempFolder folder;
  const auto read = [&](const std::string& comment) {
    return WithComment(folder, comment).traits.render_model;
  };
  EXPECT_EQ(read("SplatRenderMode: mip"), RenderModel::kMip);  // brush
  EXPECT_EQ(read("SPLATRENDERMODE:   Mip "), RenderModel::kMip);
  EXPECT_EQ(read("SplatRenderMode: default"), RenderModel::kDefault);
  EXPECT_EQ(read("antialiased 1"), RenderModel::kMip);  // Postshot
  EXPECT_EQ(read("antialiased 0"), RenderModel::kDefault);
  EXPECT_EQ(read("SplatRenderMode: 2dgs"), RenderModel::k2dgs);
  EXPECT_EQ(read("SplatRenderMode: 3dgut"), RenderModel::k3dgut);
  EXPECT_EQ(read("it is antialiased 1 time"), RenderModel::kDefault);
  const GaussianModel mip = WithComment(folder, "antialiased 1");
  EXPECT_EQ(mip.traits.render_model_reason, "comment antialiased 1");
  EXPECT_THAT(mip.source.notes, IsEmpty());
  const GaussianModel unknown = WithComment(folder, "SplatRenderMode: banana");
  EXPECT_EQ(unknown.traits.render_model, RenderModel::kDefault);
  EXPECT_THAT(unknown.source.notes, ElementsAre(HasSubstr("banana")));
  EXPECT_THAT(WithComment(folder, "SplatRenderMode: 3dgut").source.notes,
              ElementsAre(HasSubstr("3DGUT")));
  EXPECT_EQ(WithComment(folder, "ColorSpace lin_rec709_display").traits.color_space,
            ColorSpace::kLinearDisplay);
}

TEST(SplatTags, APlyKeepsItsBytesUnlessTheModelChanges) {
  TempFolder folder;
  for (const char* comment : {"antialiased 1", "SplatRenderMode: mip", "nothing"}) {
    const GaussianModel model = WithComment(folder, comment);
    WriteSplat(folder / "again.ply", model);
    EXPECT_EQ(ReadFile(folder / "again.ply"), ReadFile(folder / "tagged.ply")) << comment;
  }
  GaussianModel model = WithComment(folder, "antialiased 1");
  model.traits.render_model = RenderModel::kDefault;
  WriteSplat(folder / "again.ply", model);
  EXPECT_EQ(ReadSplat(folder / "again.ply").traits.render_model, RenderModel::kDefault);
  EXPECT_THAT(ReadFile(folder / "again.ply").substr(0, 300), Not(HasSubstr("antialiased")));
}

TEST(SplatTags, AFormatKeepsThemOrSaysWhatIsLost) {
  struct Case {
    const char* name;
    bool mip, flat, unscented, linear;  // whether it keeps that
  };
  constexpr Case kCases[] = {
      {"a.ply", true, true, true, true},       {"a.compressed.ply", true, true, true, true},
      {"a.spz", true, false, false, false},    {"a.sog", true, true, false, false},
      {"a.splat", false, false, false, false}, {"a.glb", false, false, false, true}};
  TempFolder folder;
  for (const Case& one : kCases) {
    SCOPED_TRACE(one.name);
    const SplatCodec& codec = CodecForWriting(folder / one.name);
    const auto lost = [&](const GaussianModel& model) {
      return testing::Value(codec.Losses(model), Contains(HasSubstr("cannot say")));
    };
    EXPECT_FALSE(lost(Tagged(RenderModel::kDefault)));
    const std::pair<RenderModel, bool> models[] = {{RenderModel::kMip, one.mip},
                                                   {RenderModel::k2dgs, one.flat},
                                                   {RenderModel::k3dgut, one.unscented}};
    for (const auto& [render_model, keeps] : models) {
      const GaussianModel model = Tagged(render_model);
      EXPECT_EQ(lost(model), !keeps) << NameOf(render_model);
      WriteSplat(folder / one.name, model);
      const GaussianModel back = ReadSplat(folder / one.name);
      EXPECT_EQ(back.traits.render_model, keeps ? render_model : RenderModel::kDefault);
      // Once more, from the file's own bytes.
      WriteSplat(folder / one.name, back);
      EXPECT_EQ(ReadSplat(folder / one.name).traits.render_model, back.traits.render_model);
      if (!keeps || render_model != RenderModel::kMip) continue;
      GaussianModel plain = back;
      plain.traits.render_model = RenderModel::kDefault;
      WriteSplat(folder / one.name, plain);
      EXPECT_EQ(ReadSplat(folder / one.name).traits.render_model, RenderModel::kDefault);
    }
    const GaussianModel linear = Tagged(RenderModel::kDefault, ColorSpace::kLinearDisplay);
    EXPECT_EQ(lost(linear), !one.linear);
    WriteSplat(folder / one.name, linear);
    EXPECT_EQ(ReadSplat(folder / one.name).traits.color_space,
              one.linear ? ColorSpace::kLinearDisplay : ColorSpace::kSrgbDisplay);
  }
}

// Discs have two scales. They are read as thin Gaussians, and written as discs.
TEST(SplatTags, DiscsStayDiscs) {
  TempFolder folder;
  WriteSplat(folder / "discs.ply", Tagged(RenderModel::k2dgs));
  const std::string bytes = ReadFile(folder / "discs.ply");
  EXPECT_THAT(bytes.substr(0, 2000), Not(HasSubstr("scale_2")));
  const size_t tag = bytes.find("comment SplatRenderMode: 2dgs\n");
  ASSERT_NE(tag, std::string::npos);
  // The columns tell as well.
  SpillFile(folder / "untagged.ply", std::string(bytes).erase(tag, 30));
  for (const char* name : {"discs.ply", "untagged.ply"}) {
    const GaussianModel discs = ReadSplat(folder / name);
    EXPECT_EQ(discs.traits.render_model, RenderModel::k2dgs);
    EXPECT_THAT(discs.source.notes, ElementsAre(HasSubstr("2D Gaussians")));
    for (size_t g = 0; g < discs.NumGaussians(); ++g) {
      EXPECT_EQ(discs.log_scales[3 * g + 1], RandomScene(40, 1).log_scales[3 * g + 1]);
      EXPECT_NEAR(discs.log_scales[3 * g + 2], std::log(1.17549435e-38f), 1e-4);
    }
    WriteSplat(folder / "again.ply", discs);
    const std::string again = ReadFile(folder / "again.ply");
    EXPECT_EQ(again.size(), bytes.size());
    EXPECT_EQ(again.substr(again.find("end_header")), bytes.substr(bytes.find("end_header")));
  }
}

TEST(SplatTags, ASogSaysItInEitherWord) {
  TempFolder folder;
  std::filesystem::create_directory(folder / "sog");
  WriteSplat(folder / "sog" / "meta.json", RandomScene(40, 0));
  const auto plain = nlohmann::json::parse(ReadFile(folder / "sog" / "meta.json"));
  EXPECT_FALSE(plain.contains("model"));
  const auto read = [&](const char* key, const nlohmann::json& value) {
    nlohmann::json meta = plain;
    meta[key] = value;
    SpillFile(folder / "sog" / "meta.json", meta.dump());
    return ReadSplat(folder / "sog" / "meta.json");
  };
  EXPECT_EQ(read("model", "antialiased").traits.render_model, RenderModel::kMip);
  EXPECT_EQ(read("antialias", true).traits.render_model, RenderModel::kMip);
  EXPECT_EQ(read("antialias", false).traits.render_model, RenderModel::kDefault);
  EXPECT_EQ(read("model", "2dgs").traits.render_model, RenderModel::k2dgs);
  EXPECT_THAT(read("model", "banana").source.notes, ElementsAre(HasSubstr("banana")));
}

}  // namespace
}  // namespace retint
