// SPDX-License-Identifier: BSD-3-Clause
#include "opening/scene_check.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "colmap_io/image_io.h"
#include "tests/editing/session_scene.h"
#include "tests/support/data.h"

namespace retint {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;
using testing::IsEmpty;

// The tiny cloud with its own renders as photos.
class SceneCheckTest : public testing::Test {
 protected:
  SceneCheckTest() {
    Renderer renderer = scene_.MakeRenderer();
    for (size_t v = 0; v < scene_.cameras.size(); ++v) {
      WritePng(folder_ / ViewName(v), renderer.Render(scene_.cameras[v]).rgb);
    }
  }

  SceneCheck Check(const GaussianModel& model) {
    Workspace workspace = MakeWorkspace(scene_);
    workspace.image_folder = folder_.path();
    SessionOptions session_options;
    session_options.backend = "cpu";
    EditSession session(std::move(workspace), model, session_options);
    Monitor monitor;
    return CheckScene(session.scene(), monitor, options_);
  }

  const TinyScene scene_{41};
  TempFolder folder_;
  SceneCheckOptions options_;
};

TEST_F(SceneCheckTest, ASceneThatFitsIsNotWarnedOf) {
  const SceneCheck check = Check(scene_.model);
  EXPECT_THAT(check.warnings, IsEmpty());
  EXPECT_THAT(check.missing_photos, IsEmpty());
  EXPECT_EQ(check.views, static_cast<int>(scene_.cameras.size()));
  EXPECT_EQ(check.comparisons.size(), static_cast<size_t>(options_.max_views));
  EXPECT_GT(check.median_psnr, 35);
  EXPECT_GT(check.median_coverage, 0.05);
  EXPECT_LT(check.median_coverage,
            options_.min_coverage);  // the cloud fills little of its pictures
}

TEST(ColorsTest, OfAnyCoefficientFarOutsideADisplayAreTold) {
  TinyScene scene(41);
  EXPECT_EQ(WarningOfColors(scene.model), "");
  const size_t block = static_cast<size_t>(scene.model.NumShCoeffs()) * 3;
  scene.model.sh[7 * block] = 177;  // 49.9 times white
  EXPECT_EQ(WarningOfColors(scene.model), "");
  scene.model.sh[9 * block + 5] = -1e30F;
  scene.model.sh[11 * block] = 178;  // 50.2 times
  EXPECT_THAT(
      WarningOfColors(scene.model),
      HasSubstr("colors of 2 Gaussians are far outside what a display shows (Gaussian 9 has "
                "the SH coefficient -1e+30)"));
  std::vector<uint32_t> records(scene.model.NumGaussians());
  records[9] = 900;
  EXPECT_THAT(WarningOfColors(scene.model, records), HasSubstr("(Gaussian 900 has"));
  SessionOptions options;
  options.backend = "cpu";
  const EditSession session(MakeWorkspace(scene), scene.model, options);
  EXPECT_THAT(session.warnings(), ElementsAre(WarningOfColors(scene.model)));
}

TEST_F(SceneCheckTest, SmallComparisonsSayTheSame) {
  const double whole = Check(scene_.model).median_coverage;
  options_.longest_side = scene_.cameras[0].camera.width / 2;
  const SceneCheck check = Check(scene_.model);
  EXPECT_THAT(check.warnings, IsEmpty());
  EXPECT_GT(check.median_psnr, 20);
  EXPECT_NEAR(check.median_coverage, whole, 0.05);
}

TEST_F(SceneCheckTest, MissingPhotosAreNamed) {
  std::filesystem::remove(folder_ / ViewName(1));
  std::filesystem::remove(folder_ / ViewName(4));
  const SceneCheck check = Check(scene_.model);
  EXPECT_THAT(check.missing_photos, ElementsAre(ViewName(1), ViewName(4)));
  EXPECT_THAT(check.warnings,
              ElementsAre(AllOf(HasSubstr("2 of 6 views are missing: view1, view4; there is no "),
                                EndsWith((folder_ / ViewName(1)).string()))));
}

TEST_F(SceneCheckTest, ASplatElsewhereIsInAnotherFrame) {
  GaussianModel moved = scene_.model;
  for (float& mean : moved.means) mean += 100;
  const SceneCheck check = Check(moved);
  EXPECT_EQ(check.median_coverage, 0);
  EXPECT_THAT(check.warnings, ElementsAre(HasSubstr("another frame")));
}

// In a unit so large that the scene lies within the rasterizer's near plane nothing is drawn, which
// no other frame mends.
TEST_F(SceneCheckTest, ASceneNearerThanIsDrawnIsNotInAnotherFrame) {
  Workspace workspace = MakeWorkspace(scene_);
  for (auto& [id, view] : workspace.reconstruction.views) {
    view.observations.push_back({{1, 1}, 1});
  }
  workspace.reconstruction.points[1].xyz = Eigen::Vector3d::Zero();
  const auto check = [&](double scale) {
    Workspace scaled = workspace;
    Sim3d smaller;
    smaller.scale = scale;
    scaled.Transform(smaller);
    GaussianModel model = scene_.model;
    for (float& mean : model.means) mean *= float(scale);
    for (float& size : model.log_scales) size += std::log(float(scale));
    SessionOptions session_options;
    session_options.backend = "cpu";
    EditSession session(std::move(scaled), model, session_options);
    Monitor monitor;
    return CheckScene(session.scene(), monitor, options_);
  };
  EXPECT_EQ(check(1).median_near, 0);
  const SceneCheck tiny = check(1e-3);
  EXPECT_EQ(tiny.median_near, 1);
  EXPECT_EQ(tiny.median_coverage, 0);
  EXPECT_THAT(tiny.mismatch, HasSubstr("nearer to it than 0.2"));
}

// Moved by three of 64 pixels: renders and photos do not disagree by much, but less where a render
// is moved back.
TEST_F(SceneCheckTest, ASplatALittleAsideIsFoundByMovingRenders) {
  EXPECT_EQ(Check(scene_.model).median_gain, 0);
  GaussianModel moved = scene_.model;
  for (size_t g = 0; g < moved.NumGaussians(); ++g) moved.means[3 * g] += 0.2F;
  options_.min_psnr = 0;
  const SceneCheck check = Check(moved);
  EXPECT_GT(check.median_gain, options_.max_gain);
  EXPECT_GT(check.median_moved, 0.02);
  EXPECT_LT(check.median_moved, 0.09);
  EXPECT_THAT(check.warnings, ElementsAre(HasSubstr("better moved by")));
}

TEST_F(SceneCheckTest, AViewTellsOfAMismatchWhereItHasAPhoto) {
  const auto mismatch = [&](const GaussianModel& model, bool has_photos) {
    Workspace workspace = MakeWorkspace(scene_);
    if (has_photos) workspace.image_folder = folder_.path();
    SessionOptions session_options;
    session_options.backend = "cpu";
    EditSession session(std::move(workspace), model, session_options);
    return MismatchIn(session.scene(), session.scene().reconstruction().ViewsByName());
  };
  GaussianModel moved = scene_.model;
  for (float& mean : moved.means) mean += 0.2F;
  EXPECT_EQ(mismatch(scene_.model, true), "");
  EXPECT_THAT(mismatch(moved, true), HasSubstr("retint align"));
  EXPECT_EQ(mismatch(moved, false), "");
}

TEST_F(SceneCheckTest, PhotosOfSomethingElseDisagree) {
  Image noise(scene_.cameras[0].camera.width, scene_.cameras[0].camera.height);
  uint32_t state = 1;
  for (float& value : noise.data) {
    state = state * 1664525u + 1013904223u;
    value = (state >> 31) != 0 ? 1.0F : 0.0F;
  }
  for (size_t v = 0; v < scene_.cameras.size(); ++v) WritePng(folder_ / ViewName(v), noise);
  const SceneCheck check = Check(scene_.model);
  EXPECT_LT(check.median_psnr, 10);
  EXPECT_THAT(check.warnings, ElementsAre(HasSubstr("disagree")));
}

}  // namespace
}  // namespace retint
