// SPDX-License-Identifier: BSD-3-Clause
// Rounds of painting on the ball before the wall, against its exact masks.
#include <algorithm>
#include <cstring>

#include <gtest/gtest.h>

#include "base/error.h"
#include "editing/edit_session.h"
#include "scene/mask_pixels.h"
#include "selecting/paint_held.h"
#include "selection/paint_reach.h"
#include "tests/editing/tiny_session.h"
#include "tests/support/iou.h"

namespace retint {
namespace {

constexpr int kViews = 5;
const ColorEdit kBlue = ColorEdit::Tint({0.2F, 0.4F, 1.0F});

// `part` of `whole`: pixels whose column is on the given side of `column`.
Mask LeftOf(const Mask& whole, int column, bool left) {
  Mask part = whole;
  for (int y = 0; y < part.height; ++y) {
    for (int x = 0; x < part.width; ++x) {
      if ((x < column) != left) part(x, y) = 0;
    }
  }
  return part;
}

class SelectionRound : public testing::Test {
 protected:
  SelectionRound() {
    session_ = TinySession(world_);
    select_.depth_method = "gaussian";  // exact enough here; stereo is tested where it belongs
  }

  PaintRound Round(int view, Mask mask, Mask before = {}) const {
    return {{world_.view(view).name, world_.Posed(view), std::move(mask)}, std::move(before)};
  }
  RegionSelection Select(const RegionSelection* base, PaintRound round) {
    return session_->selection().SelectRound(base, std::move(round), select_, {}, monitor_);
  }
  const Mask& MaskOf(const RegionSelection& selection, int view) const {
    return selection.masks.at(world_.view(view).name);
  }
  // Left of it lies that part of the ball in view 2, or a little more.
  int ColumnAt(double part) const {
    int column = 0;
    while (double(CountInside(LeftOf(Truth(2), column, true))) <
           part * double(CountInside(Truth(2))))
      ++column;
    return column;
  }
  Mask Truth(int view) const { return world_.BallMask(world_.Posed(view)); }

  TinyWorld world_ = TinyWorld::Make(kViews, 600, 0.002, 7);
  std::unique_ptr<EditSession> session_;
  SelectOptions select_;
  Monitor monitor_;
};

TEST_F(SelectionRound, TheFirstRoundReachesEveryView) {
  const RegionSelection selection = Select(nullptr, Round(2, Truth(2)));
  ASSERT_EQ(selection.masks.size(), size_t(kViews));
  for (int v = 0; v < kViews; ++v) EXPECT_GT(IouOf(MaskOf(selection, v), Truth(v)), 0.8) << v;
  ASSERT_EQ(selection.source.painted.size(), 1u);
  EXPECT_FALSE(selection.source.cloud.points.empty());
  EXPECT_GT(selection.Bytes(), selection.source.cloud.points.size() * sizeof(SelectionPoint));
}

TEST_F(SelectionRound, ExactPaintReachesLeast) {
  const auto selected = [&](PaintReach reach) {
    ProjectorOptions project;
    SetReach(reach, &project);
    const RegionSelection selection =
        session_->selection().SelectRound(nullptr, Round(2, Truth(2)), select_, project, monitor_);
    EXPECT_EQ(MaskOf(selection, 2).data, Truth(2).data) << "the painted view's mask is the paint";
    size_t pixels = 0;
    for (const auto& [name, mask] : selection.masks) pixels += CountInside(mask);
    return pixels;
  };
  const size_t exact = selected(PaintReach::kExact);
  EXPECT_LE(exact, selected(PaintReach::kSurface));
  EXPECT_LT(exact, selected(PaintReach::kObject)) << "which has sides that nobody painted";
}

TEST_F(SelectionRound, SaysWhereAMaskHoldsLessThanHalfOfItsPaint) {
  const std::vector<PaintedView> painted = {Round(2, Truth(2)).view, Round(3, Truth(3)).view};
  const std::string name = world_.view(2).name;
  std::map<std::string, Mask> masks = {{name, Truth(2)}, {world_.view(3).name, Truth(3)}};
  const auto warnings = [&](const std::vector<PaintedView>& of) {
    return WarningsOfPaint(session_->scene().workspace(), of, masks);
  };
  EXPECT_TRUE(warnings(painted).empty());
  masks[name] = Mask(Truth(2).width, Truth(2).height);
  ASSERT_EQ(warnings(painted).size(), 1u);
  EXPECT_NE(warnings(painted)[0].find("view " + name + " holds 0 %"), std::string::npos);
  // Pixels that the painter did not see are no evidence.
  std::vector<PaintedView> blind = painted;
  blind[0].seen = Mask(Truth(2).width, Truth(2).height);
  EXPECT_TRUE(warnings(blind).empty());
  masks[name] = LeftOf(Truth(2), ColumnAt(0.4), true);
  EXPECT_EQ(warnings(painted).size(), 1u);
  masks[name] = LeftOf(Truth(2), ColumnAt(0.55), true);
  EXPECT_TRUE(warnings(painted).empty());
  masks.erase(name);
  EXPECT_TRUE(warnings(painted).empty());
}

TEST_F(SelectionRound, ASecondRoundExtendsFromAnotherView) {
  const int column = 81;
  const RegionSelection half = Select(nullptr, Round(2, LeftOf(Truth(2), column, true)));
  const double before = IouOf(MaskOf(half, 2), Truth(2));
  EXPECT_LT(before, 0.75);
  const RegionSelection whole = Select(&half, Round(1, Truth(1), MaskOf(half, 1)));
  EXPECT_EQ(whole.source.painted.size(), 2u);
  for (int v = 0; v < kViews; ++v) EXPECT_GT(IouOf(MaskOf(whole, v), Truth(v)), 0.8) << v;
}

TEST_F(SelectionRound, ASecondRoundErasesWhatTheFirstPaintedTooMuch) {
  Mask all(160, 120, 255);  // the wall too
  const RegionSelection everything = Select(nullptr, Round(2, all));
  EXPECT_LT(IouOf(MaskOf(everything, 2), Truth(2)), 0.5);
  const size_t points = everything.source.cloud.points.size();
  const RegionSelection ball = Select(&everything, Round(1, Truth(1), MaskOf(everything, 1)));
  EXPECT_LT(ball.source.cloud.points.size(), points);
  EXPECT_GT(IouOf(MaskOf(ball, 1), Truth(1)), 0.8);
  // The part of the wall in view 1 is gone from view 2 as well. Nobody marked the rest.
  double seen = 0, painted = 0, selected = 0;
  for (int y = 0; y < all.height; ++y) {
    for (int x = 0; x < all.width; ++x) {
      const auto hit = world_.Cast(world_.Posed(2), {x + 0.5, y + 0.5});
      if (!hit || hit->on_ball) continue;
      const auto at = world_.Posed(1).Project(hit->position);
      if (!at || at->x() < 2 || at->y() < 2 || at->x() > 158 || at->y() > 118) continue;
      const auto there = world_.Cast(world_.Posed(1), at->head<2>());
      if (!there || there->on_ball) continue;
      seen += 1;
      painted += ball.source.painted[0].mask(x, y) >= 128;
      selected += MaskOf(ball, 2)(x, y) >= 128;
    }
  }
  ASSERT_GT(seen, 5000);
  EXPECT_LT(painted, 0.1 * seen) << "but for the ball's rim, where the first masks were unsure";
  EXPECT_EQ(selected, painted) << "the mask is the paint";
}

TEST_F(SelectionRound, ThePaintedViewShowsThePaint) {
  const Mask half = LeftOf(Truth(2), 81, true);
  const RegionSelection selection = Select(nullptr, Round(2, half));
  EXPECT_EQ(MaskOf(selection, 2).data, half.data);
}

TEST(MayStandForTest, WhatTheSceneDecidesIsHalfToFiveQuartersOfThePaint) {
  const auto of_pixels = [](int count) {
    Mask mask(20, 10);
    std::fill_n(mask.data.begin(), count, uint8_t{255});
    return mask;
  };
  for (const int count : {50, 100, 125}) {
    EXPECT_TRUE(MayStandFor(of_pixels(100), of_pixels(count))) << count;
  }
  for (const int count : {0, 49, 126, 200}) {
    EXPECT_FALSE(MayStandFor(of_pixels(100), of_pixels(count))) << count;
  }
}

TEST_F(SelectionRound, AViewPaintedAgainReplacesItsPaint) {
  PaintRound first = Round(2, LeftOf(Truth(2), 81, true));
  first.view.outlined_by = "a network";
  const RegionSelection half = Select(nullptr, first);
  EXPECT_EQ(half.source.reports.at(0).outlined_by, "a network");
  const RegionSelection other =
      Select(&half, Round(2, LeftOf(Truth(2), 81, false), MaskOf(half, 2)));
  ASSERT_EQ(other.source.painted.size(), 1u);
  EXPECT_GT(IouOf(MaskOf(other, 2), LeftOf(Truth(2), 81, false)), 0.8);
  EXPECT_EQ(other.source.reports.at(0).outlined_by, "a network") << "it was changed, not replaced";
}

TEST_F(SelectionRound, AFreeCameraCanBePainted) {
  PosedCamera camera = world_.Posed(2);
  camera.cam_from_world.translation += Eigen::Vector3d(0.1, -0.15, 0.2);
  PaintRound round{{"", camera, world_.BallMask(camera)}, {}};
  const RegionSelection selection = Select(nullptr, round);
  EXPECT_EQ(selection.source.painted[0].name, "free view 1");
  for (int v = 0; v < kViews; ++v) EXPECT_GT(IouOf(MaskOf(selection, v), Truth(v)), 0.8) << v;
  EXPECT_GT(IouOf(session_->selection().SeenFrom(selection, camera), world_.BallMask(camera)), 0.8);
  // A second free view gets a name of its own.
  const RegionSelection again = Select(&selection, round);
  ASSERT_EQ(again.source.painted.size(), 2u);
  EXPECT_EQ(again.source.painted[1].name, "free view 2");
}

TEST_F(SelectionRound, MasksFromFilesCountAsPaint) {
  RegionSelection loaded;
  for (int v = 0; v < kViews; ++v) {
    loaded.masks[world_.view(v).name] = LeftOf(Truth(v), 81, true);
  }
  const RegionSelection whole = Select(&loaded, Round(1, Truth(1), MaskOf(loaded, 1)));
  EXPECT_EQ(whole.source.painted.size(), size_t(kViews));
  for (int v = 0; v < kViews; ++v) EXPECT_GT(IouOf(MaskOf(whole, v), Truth(v)), 0.75) << v;
}

TEST_F(SelectionRound, NothingLeftIsAnError) {
  EXPECT_THROW(Select(nullptr, Round(2, Mask(160, 120))), InputError);
  const RegionSelection ball = Select(nullptr, Round(2, Truth(2)));
  EXPECT_THROW(Select(&ball, Round(2, Mask(160, 120), Truth(2))), InputError);
  EXPECT_THROW(Select(nullptr, Round(2, Mask(10, 10, 255))), InputError);
  EXPECT_THROW(Select(nullptr, Round(2, Truth(2), Mask(10, 10, 255))), InputError);
}

TEST_F(SelectionRound, CancelLeavesTheSessionAsItWas) {
  Monitor cancelled;
  cancelled.Cancel();
  EXPECT_THROW(
      session_->selection().SelectRound(nullptr, Round(2, Truth(2)), select_, {}, cancelled),
      Cancelled);
  EXPECT_TRUE(session_->store().regions().regions.empty());
  EXPECT_FALSE(session_->store().history().CanUndo());
}

TEST_F(SelectionRound, ReplacingASelectionIsOneStepAndOutdatesTheFit) {
  RegionSelection half = Select(nullptr, Round(2, LeftOf(Truth(2), 81, true)));
  const RegionId region =
      session_->store().Add("ball", half.masks, half.shares, kBlue, monitor_, half.source);
  const auto first = session_->store().regions().Find(region)->selection;
  EXPECT_EQ(first->source.painted.size(), 1u);
  RefitJob job;
  job.options.mm.iterations = 2;
  session_->refits().Refit(job, monitor_);
  const std::string key = session_->store().regions().FitKey(0, job);
  EXPECT_EQ(session_->store().regions().Find(region)->fit->key, key);

  RegionSelection whole = Select(first.get(), Round(1, Truth(1), MaskOf(half, 1)));
  session_->store().SetSelection(region, whole.masks, whole.shares, monitor_, whole.source);
  const Region* replaced = session_->store().regions().Find(region);
  EXPECT_NE(replaced->selection, first);
  EXPECT_EQ(replaced->selection->source.painted.size(), 2u);
  EXPECT_NE(session_->store().regions().FitKey(0, job), key);
  EXPECT_EQ(replaced->name, "ball");
  EXPECT_EQ(session_->store().history().UndoLabel(), "Select ball");
  ASSERT_TRUE(session_->store().history().Undo());
  EXPECT_EQ(session_->store().regions().Find(region)->selection, first);
  ASSERT_TRUE(session_->store().history().Redo());
  EXPECT_EQ(session_->store().regions().Find(region)->selection->source.painted.size(), 2u);

  EXPECT_THROW(session_->store().SetSelection(99, half.masks, half.shares, monitor_), OptionError);
  EXPECT_THROW(session_->store().SetSelection(region, {}, {}, monitor_), InputError);
  EXPECT_FALSE(session_->store().history().CanRedo());
}

}  // namespace
}  // namespace retint
