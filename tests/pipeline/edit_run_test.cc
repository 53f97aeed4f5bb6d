// SPDX-License-Identifier: BSD-3-Clause
#include "pipeline/edit_run.h"

#include <gtest/gtest.h>

#include "base/files.h"
#include "colmap_io/depth_map_io.h"
#include "colmap_io/image_io.h"
#include "tests/saving/saved_scene.h"

namespace retint {
namespace {

namespace fs = std::filesystem;

// A job whose edit is a picture of the first view, which has a photo.
class PictureJob : public testing::Test {
 protected:
  PictureJob() {
    WriteTinyScene(scene_, folder_.path());
    Renderer renderer = scene_.MakeRenderer();
    render_ = renderer.Render(scene_.cameras[0]).rgb;
    WritePng(Photo(), render_);
    WritePng(folder_ / "mask.png", scene_.masks[0]);
    Paint({0.2F, 0.4F, 1.0F});
    job_.options.refit.options.mm.iterations = 2;
    job_.regions.emplace_back();
    job_.regions[0].name = "toy";
    job_.regions[0].masks[ViewName(0)] = folder_ / "mask.png";
    job_.regions[0].edit.operations = {ColorOperation::Picture({{ViewName(0), Picture(), {}}})};
  }

  fs::path Photo() const { return folder_ / "ws/images/view0.png"; }
  std::string Picture() const { return folder_ / "picture.png"; }
  void Paint(const std::array<float, 3>& tint) {
    Image painted = render_;
    for (size_t p = 0; p < painted.NumPixels(); ++p) {
      if (scene_.masks[0].data[p] < 128) continue;
      for (size_t c = 0; c < 3; ++c) painted.data[3 * p + c] *= tint[c];
    }
    WritePng(Picture(), painted);
  }
  // Whether the last region's fit was there already.
  bool IsKept() { return IsKept(OpenTinyScene(folder_.path())); }
  bool IsKept(std::unique_ptr<EditSession> session) {
    StageCache cache(folder_ / "cache");
    WholeScene scene(std::move(session));
    bool kept = false;
    Monitor monitor;
    EditRun run(job_, scene, cache,
                {.stage = [&](const EditStage& stage) { kept = stage.cached; }, .warning = {}});
    run.Run(monitor);
    return kept;
  }

  const TinyScene scene_{31};
  const TempFolder folder_;
  Image render_;
  EditRecipe job_;
};

TEST_F(PictureJob, FitsAgainWhatWasPaintedAnew) {
  EXPECT_FALSE(IsKept());
  EXPECT_TRUE(IsKept());
  Paint({1.0F, 0.4F, 0.2F});
  EXPECT_FALSE(IsKept());
  EXPECT_TRUE(IsKept());
}

TEST_F(PictureJob, FitsAgainWhereThePhotoIsAnother) {
  EXPECT_FALSE(IsKept());
  Image other = render_;
  for (float& value : other.data) value *= 0.8F;
  WritePng(Photo(), other);
  EXPECT_FALSE(IsKept());
}

// A SOG's own file names the pictures that its values are in.
TEST_F(PictureJob, FitsAgainWhereAFileBesideTheSplatsIsAnother) {
  const fs::path splat = folder_ / "sog/meta.json";
  WriteSplat(splat, scene_.model);
  const auto is_kept = [&] {
    SessionOptions options;
    options.backend = "cpu";
    Monitor monitor;
    return IsKept(EditSession::Open(folder_ / "ws", splat, options, monitor));
  };
  EXPECT_FALSE(is_kept());
  EXPECT_TRUE(is_kept());
  GaussianModel turned = scene_.model;
  for (size_t i = 1; i < turned.quats_wxyz.size(); i += 4) turned.quats_wxyz[i] += 0.5F;
  WriteSplat(folder_ / "turned/meta.json", turned);
  EXPECT_EQ(ReadFile(folder_ / "turned/meta.json"), ReadFile(splat));
  fs::copy_file(folder_ / "turned/quats.webp", folder_ / "sog/quats.webp",
                fs::copy_options::overwrite_existing);
  EXPECT_FALSE(is_kept());
}

TEST_F(PictureJob, ItsSessionGoesOnFromTheFinerSplat) {
  job_.regions[0].refine = RefineOptions{.pixels = 0.5, .most = 2000};
  job_.outputs.session = folder_ / "job.retint";
  job_.outputs.finer_splat = folder_ / "finer.ply";
  StageCache cache(folder_ / "cache");
  WholeScene scene(OpenTinyScene(folder_.path()));
  Monitor monitor;
  std::vector<std::string> stages;
  EditRun run(
      job_, scene, cache,
      {.stage = [&](const EditStage& stage) { stages.push_back(stage.name); }, .warning = {}});
  run.Run(monitor);
  EXPECT_EQ(stages, (std::vector<std::string>{"refine", "refit"}));
  run.Write({}, monitor);
  SessionOptions options;
  options.backend = "cpu";
  const OpenedSession opened = OpenSession(job_.outputs.session, options, monitor);
  EXPECT_GT(opened.session->scene().original().NumGaussians(), scene_.model.NumGaussians());
  EXPECT_EQ(opened.session->scene().splat_path(), job_.outputs.finer_splat);
  EXPECT_TRUE(SameBits(opened.session->refits().CurrentSh(), run.session().refits().CurrentSh()));
  EXPECT_FALSE(
      SameBits(opened.session->refits().CurrentSh(), opened.session->scene().original().sh));
}

// Keys do not contain COLMAP's depth, nor results that start from such a region's colors.
TEST_F(PictureJob, FitsAgainAfterARegionOfDepthMaps) {
  RegionRecipe measured;
  measured.name = "measured";
  measured.paint = {{ViewName(0), folder_ / "mask.png"}};
  measured.edit = ColorEdit::Tint({1.0F, 0.3F, 0.1F});
  measured.options.select.depth_method = "colmap";
  job_.regions.insert(job_.regions.begin(), measured);
  const fs::path maps = folder_ / "ws/stereo/depth_maps";
  fs::create_directories(maps);
  const auto fit_at = [&](double depth) {
    const Camera& camera = scene_.cameras[0].camera;
    WriteDepthMap(maps / (ViewName(0) + ".geometric.bin"),
                  DepthMap(camera.width, camera.height, float(depth)));
    return IsKept();
  };
  const double middle = scene_.cameras[0].cam_from_world.translation.norm();
  EXPECT_FALSE(fit_at(middle));
  EXPECT_FALSE(fit_at(0.9 * middle));
  job_.regions.erase(job_.regions.begin());
  EXPECT_FALSE(IsKept());
  EXPECT_TRUE(IsKept());
}

}  // namespace
}  // namespace retint
