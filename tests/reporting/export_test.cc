// SPDX-License-Identifier: BSD-3-Clause
#include "reporting/export.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/files.h"
#include "colmap_io/image_io.h"
#include "tests/saving/saved_scene.h"

namespace retint {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class Export : public ::testing::Test {
 protected:
  Export() { EditTinyScene(scene_, *session_); }

  const TinyScene scene_{51};
  const TempFolder folder_;
  Monitor monitor_;
  std::unique_ptr<EditSession> session_ = MakeSession(scene_);
};

TEST_F(Export, ViewsShowTheEdit) {
  const auto views = session_->scene().reconstruction().ViewsByName();
  const FloatArray sh = session_->refits().CurrentSh();
  ExportViews(*session_, {views[1], views[3]}, sh, folder_ / "out", monitor_);
  EXPECT_FALSE(fs::exists(folder_ / "out" / "view0.png"));
  const Image expected = session_->scene().Render(*views[3], sh);
  const Image found = ReadImage(folder_ / "out" / "view3.png");
  ASSERT_EQ(found.data.size(), expected.data.size());
  for (size_t i = 0; i < found.data.size(); ++i) {
    ASSERT_NEAR(found.data[i], std::clamp(expected.data[i], 0.0F, 1.0F), 0.51 / 255) << i;
  }
  EXPECT_THROW(ExportViews(*session_, {}, sh, folder_ / "none", monitor_), OptionError);
}

TEST_F(Export, ACancelledExportLeavesNothing) {
  Monitor* cancel = nullptr;
  int pictures = 0;
  Monitor cancelling([&](const Progress&) {
    if (++pictures == 3) cancel->Cancel();
  });
  cancel = &cancelling;
  EXPECT_THROW(ExportViews(*session_, session_->scene().train_views(),
                           session_->refits().CurrentSh(), folder_ / "out", cancelling),
               Cancelled);
  EXPECT_TRUE(fs::is_empty(folder_.path()));
}

TEST_F(Export, AnOrbitKeepsDistanceAndAim) {
  const PosedCamera start = scene_.cameras[1];
  const Eigen::Vector3d focus(0.1, -0.2, 0.3), up(0, -2, 0);
  const auto path = OrbitPath(start, focus, up, 8);
  ASSERT_EQ(path.size(), 8u);
  EXPECT_LT((path[0].Center() - start.Center()).norm(), 1e-12);
  const Eigen::Vector3d seen = *start.Project(focus);
  for (size_t i = 0; i < path.size(); ++i) {
    EXPECT_LT((*path[i].Project(focus) - seen).norm(), 1e-9) << "the focus stays in its pixel";
    EXPECT_NEAR(path[i].Center().y(), start.Center().y(), 1e-12) << "on a circle about the axis";
    const double step = (path[(i + 1) % 8].Center() - path[i].Center()).norm();
    EXPECT_NEAR(step, (path[1].Center() - path[0].Center()).norm(), 1e-9);
    EXPECT_GT(step, 0.1);
  }
  EXPECT_THROW(OrbitPath(start, focus, {0, 0, 0}, 8), OptionError);
  EXPECT_THROW(OrbitPath(start, focus, up, 0), OptionError);
}

TEST_F(Export, APathGoesThroughTheViews) {
  const auto views = session_->scene().reconstruction().ViewsByName();
  const auto path = ViewPath(session_->scene().reconstruction(), views, 5 * 4 + 1);
  ASSERT_EQ(path.size(), 21u);
  double longest = 0, total = 0;
  for (size_t i = 0; i < path.size(); ++i) {
    if (i % 4 == 0) {
      const Rigid3d& pose = views[i / 4]->cam_from_world;
      EXPECT_LT((path[i].Center() - pose.OriginInSource()).norm(), 1e-9);
      EXPECT_LT(path[i].cam_from_world.rotation.angularDistance(pose.rotation), 1e-7);
    }
    if (i == 0) continue;
    const double step = (path[i].Center() - path[i - 1].Center()).norm();
    longest = std::max(longest, step);
    total += step;
  }
  EXPECT_LT(longest, 2 * total / 20) << "smoothly";
  EXPECT_EQ(ViewPath(session_->scene().reconstruction(), {views[0]}, 3).size(), 3u);
  EXPECT_THROW(ViewPath(session_->scene().reconstruction(), {}, 3), OptionError);
}

TEST_F(Export, FramesAreNumbered) {
  const auto path = OrbitPath(scene_.cameras[0], {0, 0, 0}, {0, 1, 0}, 3);
  ExportFrames(*session_, path, session_->refits().CurrentSh(), folder_ / "turn", monitor_);
  for (const char* name : {"0000.png", "0001.png", "0002.png"}) {
    EXPECT_EQ(ReadImage8(folder_ / "turn" / name).width, 64) << name;
  }
}

TEST_F(Export, AShorterTurnReplacesALongerOne) {
  const fs::path folder = folder_ / "turn";
  const auto turn = [&](int frames, const std::vector<fs::path>& replaced) {
    ExportFrames(*session_, OrbitPath(scene_.cameras[0], {0, 0, 0}, {0, 1, 0}, frames),
                 session_->refits().CurrentSh(), folder, monitor_, replaced);
  };
  turn(4, {});
  WriteFile(folder / "0009.png", "somebody's own picture");
  turn(2, {folder / "0000.png", folder / "0001.png", folder / "0002.png", folder / "0003.png"});
  EXPECT_TRUE(IsFile(folder / "0001.png"));
  EXPECT_FALSE(fs::exists(folder / "0002.png"));
  EXPECT_FALSE(fs::exists(folder / "0003.png"));
  EXPECT_TRUE(IsFile(folder / "0009.png"));
}

TEST_F(Export, TheReportHasEveryRegion) {
  ExportReport(*session_, RefitJob(), folder_ / "report.json", monitor_);
  const auto json = nlohmann::json::parse(ReadFile(folder_ / "report.json"));
  ASSERT_EQ(json["regions"].size(), 2u);
  EXPECT_EQ(json["regions"][1]["name"], "right");
  EXPECT_GT(json["regions"][0]["quality"]["train"]["psnr_inside_after"].get<double>(),
            json["regions"][0]["quality"]["train"]["psnr_inside_before"].get<double>() + 3);
  for (const auto& region : json["regions"]) {
    EXPECT_GT(region["quality"]["train"]["psnr_outside"].get<double>(), 20)
        << "the other region's edit is not counted as bleeding";
  }
  EXPECT_EQ(json["painted"][0]["view"], "view0");
  EXPECT_EQ(json["masks"]["views"], 6);
  EXPECT_TRUE(json["quality"]["train"]["psnr_outside"].is_null()) << "of one region only";
  EXPECT_EQ(json["options"]["solver"], "mm");
  session_->store().Do(SetVisible{2, false});
  const RunReport one = FullReport(*session_, TargetKind::kRender, monitor_);
  EXPECT_EQ(one.quality.train.views, 6);
}

TEST_F(Export, AReportThatEndsInHtmlIsAPage) {
  RefitJob job;
  job.options.mm.iterations = 7;
  ExportReport(*session_, job, folder_ / "report.html", monitor_);
  const std::string page = ReadFile(folder_ / "report.html");
  EXPECT_THAT(page, HasSubstr("<title>Recoloring of "));
  EXPECT_THAT(page, HasSubstr("<td>iterations</td><td>mm</td><td>7</td>"));
  for (const View* view : session_->scene().reconstruction().ViewsByName()) {
    EXPECT_THAT(page, HasSubstr("Before and after of " + view->name));
  }
}

}  // namespace
}  // namespace retint
