// SPDX-License-Identifier: BSD-3-Clause
// How a splat was trained and the space of its colors, on the command line.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "base/files.h"
#include "splat_io/splat_io.h"
#include "tests/e2e/command.h"
#include "tests/support/data.h"

namespace retint {
namespace {

using testing::HasSubstr;
using testing::Not;

class RenderModelTest : public testing::Test {
 protected:
  std::string Path(const char* name) const { return (temp_ / name).string(); }
  CommandResult Run(std::vector<std::string> arguments) const {
    CommandResult result = RunRetint(arguments);
    EXPECT_EQ(result.code, 0) << result.err;
    return result;
  }
  // The tiny workspace's view, as a .png.
  std::string Render(const std::string& splat, std::vector<std::string> more = {}) const {
    std::vector<std::string> arguments = {"render", workspace_, "--splat",  splat,
                                          "--view", TinyView(), "--output", Path("renders")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    Run(arguments);
    return ReadFile(temp_ / "renders" / (TinyView() + ".png"));
  }
  std::string Info(const std::string& splat, std::vector<std::string> more = {}) const {
    std::vector<std::string> arguments = {"info", workspace_, "--splat", splat, "--compare", "2"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const CommandResult result = Run(arguments);
    return result.out + result.err;
  }

  TempFolder temp_;
  const std::string workspace_ = TinyWorkspace().string();
  const std::string splat_ = (TinyWorkspace() / "splat.ply").string();
};

TEST_F(RenderModelTest, InfoSaysWhichAndWhyOrCompares) {
  EXPECT_THAT(Info(splat_), HasSubstr("render model default (its files do not say)"));
  // The sample was made for the original code.
  EXPECT_THAT(Info(splat_), HasSubstr("as mip: default fits the photos better"));
  EXPECT_THAT(Info(splat_, {"--render-model", "mip"}),
              AllOf(HasSubstr("render model mip (chosen)"), Not(HasSubstr("compared"))));
  Run({"convert", splat_, Path("tagged.ply"), "--render-model", "mip"});
  EXPECT_THAT(Info(Path("tagged.ply")),
              HasSubstr("render model mip (comment SplatRenderMode: mip)"));
  // A trainer's configuration in the folder above.
  std::filesystem::create_directories(temp_ / "run" / "ply");
  std::filesystem::copy_file(splat_, temp_ / "run" / "ply" / "point_cloud.ply");
  WriteFile(temp_ / "run" / "cfg.yml", "absgrad: false\nantialiased: true\nbatch_size: 1\n");
  EXPECT_THAT(Info(Path("run/ply/point_cloud.ply")), HasSubstr("cfg.yml: antialiased: true)"));
  WriteFile(temp_ / "run" / "cfg.yml", "antialiased: false\n");
  EXPECT_THAT(Info(Path("run/ply/point_cloud.ply")), HasSubstr("its files do not say"));
}

TEST_F(RenderModelTest, AFileAnOptionAndASessionRenderAlike) {
  const std::string plain = Render(splat_), mip = Render(splat_, {"--render-model", "mip"});
  EXPECT_NE(plain, mip);
  EXPECT_EQ(plain, Render(splat_, {"--render-model", "default"}));
  for (const char* name : {"tagged.ply", "tagged.spz", "tagged.sog"}) {
    Run({"convert", splat_, Path(name), "--render-model", "mip"});
    EXPECT_EQ(ReadSplat(temp_ / name).traits.render_model, RenderModel::kMip) << name;
  }
  EXPECT_EQ(mip, Render(Path("tagged.ply")));
  EXPECT_EQ(plain, Render(Path("tagged.ply"), {"--render-model", "default"}));
  // A job remembers it, its session and its splat do.
  const nlohmann::json job = {
      {"retint_job", 1},
      {"scene", {{"workspace", workspace_}, {"splat", splat_}, {"render_model", "mip"}}},
      {"regions",
       {{{"name", "thing"},
         {"masks", {{TinyView(), TinyMask().string()}}},
         {"edit", {{"operations", {{{"op", "gray"}}}}}}}}},
      {"outputs",
       {{"session", Path("s.retint")}, {"splats", {Path("gray.ply"), Path("gray.splat")}}}}};
  WriteFile(temp_ / "job.json", job.dump());
  const CommandResult run = Run({"run", Path("job.json")});
  EXPECT_THAT(run.err, HasSubstr("the render model mip is lost, which .splat cannot say"));
  EXPECT_EQ(ReadSplat(temp_ / "gray.ply").traits.render_model, RenderModel::kMip);
  const CommandResult session = Run({"info", Path("s.retint"), "--compare", "1"});
  EXPECT_THAT(session.out, HasSubstr("render model mip (chosen)"));
}

TEST_F(RenderModelTest, DiscsAreAnnounced) {
  GaussianModel model = ReadSplat(splat_);
  model.traits.render_model = RenderModel::k2dgs;
  WriteSplat(temp_ / "discs.ply", model);
  EXPECT_THAT(Info(Path("discs.ply")),
              AllOf(HasSubstr("render model 2dgs (comment SplatRenderMode: 2dgs)"),
                    HasSubstr("splat of 2D Gaussians (2DGS)")));
  const CommandResult render = Run({"render", workspace_, "--splat", Path("discs.ply"), "--view",
                                    TinyView(), "--output", Path("renders")});
  EXPECT_THAT(render.err, HasSubstr("splat of 2D Gaussians (2DGS)"));
}

TEST_F(RenderModelTest, ALinearSplatIsRecoloredInItsSpace) {
  GaussianModel model = ReadSplat(splat_);
  model.traits.color_space = ColorSpace::kLinearDisplay;
  WriteSplat(temp_ / "linear.glb", model);
  EXPECT_THAT(Info(Path("linear.glb")), HasSubstr("color space  lin_rec709_display"));
  EXPECT_NE(Render(splat_), Render(Path("linear.glb")));
  Run({"recolor", workspace_, "--splat", Path("linear.glb"), "--view", TinyView(), "--mask",
       TinyMask().string(), "--gray", "--output", Path("gray.glb")});
  const GaussianModel gray = ReadSplat(temp_ / "gray.glb");
  EXPECT_EQ(gray.traits.color_space, ColorSpace::kLinearDisplay);
  EXPECT_NE(gray.sh, model.sh);
}

}  // namespace
}  // namespace retint
