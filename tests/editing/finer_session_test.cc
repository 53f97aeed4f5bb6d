// SPDX-License-Identifier: BSD-3-Clause
// Sessions whose large Gaussians were split: the ball before the wall.
#include "editing/finer_session.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "editing/compare_pictures.h"
#include "scene/contact_sheet.h"
#include "splat_io/splat_io.h"
#include "tests/editing/tiny_session.h"
#include "tests/support/data.h"

namespace retint {
namespace {

class FinerSessions : public testing::Test {
 protected:
  FinerSessions() {
    fine_.pixels = 0.7;  // smaller than the world's Gaussians
    for (int v = 0; v < 3; ++v) masks_[world_.view(v).name] = world_.BallMask(world_.Posed(v));
    ball_ = session_->store().Add("ball", masks_, {}, ColorEdit::Tint({0.2F, 0.4F, 1}), monitor_);
  }

  FinerSession Split(const std::filesystem::path& splat = {}) {
    return MakeFinerSession(*session_, ball_, fine_, splat, monitor_);
  }
  // A red dot, painted on a view of the ball.
  void PaintDot() {
    const View* view = session_->scene().reconstruction().FindView(world_.view(1).name);
    const auto step = session_->refits().PictureStepOf(ball_, *view, TargetKind::kRender);
    EditedPicture picture{view->name, "gone/" + view->name, ToImage8(step.with)};
    picture.before = ToImage8(step.before);
    picture.written = picture.image;
    for (int y = 47; y <= 53; ++y) {
      for (int x = 73; x <= 79; ++x) {
        picture.image(x, y, 0) = 230, picture.image(x, y, 1) = 20, picture.image(x, y, 2) = 30;
      }
    }
    ColorEdit edit = session_->store().regions().Find(ball_)->edit;
    AddPicture(edit, picture, {view->name});
    session_->store().Do(SetEdit{ball_, edit});
  }

  Monitor monitor_;
  RefineOptions fine_;
  const TinyWorld world_ = TinyWorld::Make(3, 0, 0, 1);
  std::map<std::string, Mask> masks_;
  std::unique_ptr<EditSession> session_ = TinySession(world_);
  RegionId ball_ = 0;
};

TEST_F(FinerSessions, RegionsGoOnWithoutTheirFits) {
  const RegionId second =
      session_->store().Add("second", masks_, {}, ColorEdit::Tint({1, 0.5F, 0.5F}), monitor_);
  session_->store().Do(SetEdit{second, session_->store().regions().Find(second)->edit, 0.5F});
  session_->refits().Refit({}, monitor_);
  ASSERT_NE(session_->store().regions().Find(ball_)->fit, nullptr);
  const FinerSession finer = Split();
  ASSERT_NE(finer.session, nullptr);
  EXPECT_TRUE(finer.session->store().regions().SavesLike(session_->store().regions()));
  const Region& region = *finer.session->store().regions().Find(ball_);
  EXPECT_EQ(region.fit, nullptr);
  EXPECT_EQ(region.selection->masks.begin()->second.data, masks_.begin()->second.data);
  EXPECT_EQ(region.selection->shares.size(), finer.session->scene().original().NumGaussians());
  EXPECT_FALSE(finer.session->store().history().CanUndo());
  EXPECT_GT(finer.summary.split, 0u);
  EXPECT_EQ(finer.session->scene().original().NumGaussians(),
            finer.summary.before - finer.summary.split + finer.summary.parts);
  EXPECT_GT(finer.summary.psnr, 35);
  EXPECT_TRUE(finer.session->scene().splat_path().empty());
  // And are fitted as before.
  finer.session->refits().Refit({}, monitor_);
  EXPECT_NE(finer.session->store().regions().Find(second)->fit, nullptr);
}

TEST_F(FinerSessions, OnlyWhatTakesPaintIsSplitWhereThereIsPaint) {
  const size_t all = Split().summary.split;
  PaintDot();
  const Region& region = *session_->store().regions().Find(ball_);
  ASSERT_NE(region.paint, nullptr);
  const FinerSession finer = Split();
  EXPECT_GT(finer.summary.split, 0u);
  EXPECT_LE(finer.summary.split, region.paint->gaussians.size());
  EXPECT_LT(finer.summary.split, all / 4);
  const auto& paint = finer.session->store().regions().Find(ball_)->paint;
  ASSERT_NE(paint, nullptr);  // found again, on the parts
  EXPECT_GT(paint->gaussians.size(), region.paint->gaussians.size());
  session_->store().Do(SetEdit{ball_, ColorEdit::Tint({0.2F, 0.4F, 1})});  // the paint is gone
  EXPECT_EQ(Split().summary.split, all);
}

TEST_F(FinerSessions, TheFileHoldsTheSplatOfTheSession) {
  TempFolder temp;
  const std::filesystem::path file = temp / "finer.ply";
  const FinerSession finer = Split(file);
  ASSERT_NE(finer.session, nullptr);
  EXPECT_EQ(finer.session->scene().splat_path(), file);
  EXPECT_EQ(finer.session->scene().splat_checksum().get(), ChecksumFile(file));
  const GaussianModel read = ReadSplat(file), &model = finer.session->scene().original();
  EXPECT_EQ(read.means, model.means);
  EXPECT_EQ(read.sh, model.sh);
  EXPECT_EQ(read.opacity_logits, model.opacity_logits);
}

TEST_F(FinerSessions, ThereIsNoneWhereNothingIsLarge) {
  TempFolder temp;
  fine_.pixels = 50;
  const FinerSession finer = Split(temp / "finer.ply");
  EXPECT_EQ(finer.session, nullptr);
  EXPECT_EQ(finer.summary.split, 0u);
  EXPECT_THAT(finer.summary.Warning(fine_), testing::HasSubstr("larger than 50.0 pixels"));
  EXPECT_FALSE(std::filesystem::exists(temp / "finer.ply"));
  fine_.pixels = 0.7;
  fine_.most = 2;
  EXPECT_THAT(Split().summary.Warning(fine_),
              testing::HasSubstr("would be more than 2, so the splat is as it was: mask less"));
  EXPECT_THROW(MakeFinerSession(*session_, 77, fine_, {}, monitor_), OptionError);
}

TEST(PaintDetail, SaysWhatSplittingGains) {
  const PaintDetail detail{0.97, 8.4};
  EXPECT_EQ(detail.Problem(), "97 % of the paint is on Gaussians too large for stripes or letters");
  EXPECT_EQ(detail.Gain(), "details would be about 7 times as fine");  // 8.4 of 1.2 pixels
  EXPECT_FALSE(PaintDetail().IsTorn());
}

TEST_F(FinerSessions, SaysHowMuchPaintIsOnLargeGaussians) {
  const auto share = [&](const EditSession& session) {
    return DetailOfPaint(*session.store().regions().Find(ball_), session.scene()).on_large;
  };
  EXPECT_EQ(share(*session_), 0);
  PaintDot();
  EXPECT_EQ(share(*session_), 0);  // the ball's Gaussians are small
  TinyGaussians large(world_);
  for (float& value : large.model.log_scales) value += std::log(4.0F);
  Workspace workspace;
  workspace.reconstruction = world_.reconstruction;
  EditSession coarse(std::move(workspace), std::move(large.model), session_->scene().options());
  RegionSet regions = session_->store().regions();
  regions.regions[0].paint = nullptr;
  coarse.RestoreRegions(std::move(regions), {});
  EXPECT_GT(share(coarse), 0.9);
  const PaintDetail detail = DetailOfPaint(*coarse.store().regions().Find(ball_), coarse.scene());
  EXPECT_TRUE(detail.IsTorn());
  EXPECT_GT(detail.pixels, 3);
}

}  // namespace
}  // namespace retint
