// SPDX-License-Identifier: BSD-3-Clause
// Pictures that are handed out to be painted on, and that come back: the ball before the wall.
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "base/files.h"
#include "editing/compare_pictures.h"
#include "editing/edit_session.h"
#include "recolor/edit_text.h"
#include "scene/contact_sheet.h"
#include "tests/editing/tiny_session.h"

namespace retint {
namespace {

using Kind = ColorOperationKind;

struct Dot {
  int x, y;
};

class PictureStep : public testing::Test {
 protected:
  PictureStep() {
    session_ = TinySession(world_);
    for (int v = 0; v < 3; ++v) masks_[world_.view(v).name] = world_.BallMask(world_.Posed(v));
    ball_ = Add("ball", {});
  }

  RegionId Add(const std::string& name, const ColorEdit& edit) {
    Monitor monitor;
    return session_->store().Add(name, masks_, {}, edit, monitor);
  }
  const ColorEdit& Edit() { return session_->store().regions().Find(ball_)->edit; }
  const PictureEdit& Found() {
    for (const ColorOperation& op : Edit().operations) {
      if (op.picture) return *op.picture;
    }
    throw std::logic_error("no picture");
  }

  // As the editor hands a view out.
  EditedPicture HandOut(int v) {
    const auto step = session_->refits().PictureStepOf(ball_, *At(v), TargetKind::kRender);
    EditedPicture picture{At(v)->name, "gone/" + At(v)->name, ToImage8(step.with)};
    picture.before = ToImage8(step.before);
    picture.written = picture.image;
    return picture;
  }
  // And takes it back.
  void TakeBack(const EditedPicture& picture) {
    ColorEdit edit = Edit();
    AddPicture(edit, picture, {picture.view});
    session_->store().Do(SetEdit{ball_, edit});
  }
  void Paint(int v, const Dot& dot) {
    EditedPicture picture = HandOut(v);
    for (int y = dot.y - kDot; y <= dot.y + kDot; ++y) {
      for (int x = dot.x - kDot; x <= dot.x + kDot; ++x) {
        picture.image(x, y, 0) = 230, picture.image(x, y, 1) = 20, picture.image(x, y, 2) = 30;
      }
    }
    TakeBack(picture);
  }
  // Pixels of a view's paint.
  int Painted(int v) {
    int count = 0;
    for (const PaintLayer& layer : Found().layers) {
      if (layer.view != At(v)->name) continue;
      for (const uint8_t alpha : layer.alpha.data) count += alpha != 0 ? 1 : 0;
    }
    return count;
  }
  Image Shown(int v) {
    return session_->refits().Edited(
        *At(v), session_->scene().Render(*At(v), session_->scene().original().sh));
  }
  const View* At(int v) { return session_->scene().reconstruction().FindView(world_.view(v).name); }
  // Of a view's pixels that two pictures have in other colors, those that are not near the dot.
  int ChangedBeside(const Dot& dot, const Image& a, const Image& b) {
    int count = 0;
    for (int y = 0; y < a.height; ++y) {
      for (int x = 0; x < a.width; ++x) {
        if (std::abs(x - dot.x) <= kDot + 2 && std::abs(y - dot.y) <= kDot + 2) continue;
        for (int c = 0; c < 3; ++c) {
          if (std::abs(a(x, y, c) - b(x, y, c)) > 0.02F) ++count;
        }
      }
    }
    return count;
  }

  static constexpr int kDot = 3;  // half a side
  static constexpr int kArea = (2 * kDot + 1) * (2 * kDot + 1);
  static constexpr Dot kFirst{76, 50}, kSecond{92, 64};

  const TinyWorld world_ = TinyWorld::Make(3, 0, 0, 1);
  std::map<std::string, Mask> masks_;
  std::unique_ptr<EditSession> session_;
  RegionId ball_ = 0;
};

// Steps that follow the picture, and regions that come later, are not in the picture that is handed
// out: else they would be applied once more to all of it.
TEST_F(PictureStep, LaterStepsAndRegionsAreAppliedOnce) {
  Paint(1, kFirst);
  const Image8 whole = HandOut(1).image;
  ColorEdit edit = Edit();
  edit.operations[0].strength = 0.5F;
  edit.operations.push_back(ColorOperation::Make(Kind::kExposure, {-1}));
  session_->store().Do(SetEdit{ball_, edit});
  Add("again", ColorEdit::Tint({0.5F, 1, 0.7F}));
  // Nor are strengths, which are of the result.
  EXPECT_EQ(HandOut(1).image.data, whole.data);
  const Image before = Shown(1);
  Paint(1, kSecond);
  EXPECT_EQ(ChangedBeside(kSecond, before, Shown(1)), 0);
  EXPECT_FALSE(Edit().operations[0].table);
  EXPECT_EQ(Edit().operations[1].kind, Kind::kExposure);
  // The first dot is still there, and a pixel around each at most.
  EXPECT_GE(Painted(1), 2 * kArea);
  EXPECT_LE(Painted(1), 2 * (2 * kDot + 3) * (2 * kDot + 3));
}

TEST_F(PictureStep, EarlierStepsAndRegionsAreInThePicture) {
  session_->store().Do(SetEdit{ball_, {{ColorOperation::Make(Kind::kExposure, {-1})}, 1}});
  const RegionId first = Add("first", ColorEdit::Tint({0.5F, 1, 0.7F}));
  session_->store().Do(MoveRegion{first, 0});
  const auto step = session_->refits().PictureStepOf(ball_, *At(1), TargetKind::kRender);
  EXPECT_EQ(step.with.data, Shown(1).data);
  EXPECT_EQ(step.before.data, step.with.data);
  const Image before = Shown(1);
  Paint(1, kFirst);
  EXPECT_EQ(ChangedBeside(kFirst, before, Shown(1)), 0);
}

// The files of earlier pictures are gone, as after reopening a session. Another view's paint that
// shows here is not painted here again.
TEST_F(PictureStep, GoesOnWithoutTheEarlierPictures) {
  Paint(0, kFirst);
  const Image8 plain = ToImage8(session_->scene().Render(*At(1), session_->scene().original().sh));
  ASSERT_NE(HandOut(1).image.data, plain.data) << "carried over";
  Paint(1, kSecond);
  ASSERT_EQ(Found().pictures.size(), 2U);
  const int on_first = Painted(0);
  EXPECT_GE(on_first, kArea);
  EXPECT_GE(Painted(1), kArea);
  EXPECT_LE(Painted(1), (2 * kDot + 3) * (2 * kDot + 3));
  session_->store().Do(SetEdit{ball_, EditFromJson(EditToJson(Edit(), /*with_tables=*/true), {})});
  Paint(1, kFirst);
  EXPECT_EQ(Found().pictures.size(), 2U);
  EXPECT_EQ(Painted(0), on_first);
  EXPECT_GE(Painted(1), 2 * kArea);
}

// A map stays while further pictures say the same, and gives way to one that says more.
TEST_F(PictureStep, AGradeOfEarlierPicturesStays) {
  const auto graded = [&](int v, float gain) {
    EditedPicture picture = HandOut(v);
    for (size_t p = 0; p < picture.image.NumPixels(); ++p) {
      if (masks_.at(picture.view).data[p] < 128) continue;
      for (size_t c = 0; c < 2; ++c) {
        uint8_t& value = picture.image.data[3 * p + c];
        value = uint8_t(std::lround(gain * float(value)));
      }
    }
    return picture;
  };
  TakeBack(graded(0, 0.7F));
  const auto map = Edit().operations[0].table;
  ASSERT_TRUE(map);
  Paint(1, kFirst);
  EXPECT_EQ(Edit().operations[0].table, map);
  EXPECT_GE(Painted(1), kArea);
  EXPECT_EQ(Painted(0), 0);
  TakeBack(graded(1, 0.6F));
  ASSERT_TRUE(Edit().operations[0].table);
  EXPECT_NE(Edit().operations[0].table, map);
}

TEST_F(PictureStep, WhatWasPaintedCanBeTakenAway) {
  EXPECT_THROW(TakeBack(HandOut(1)), InputError) << "nothing was painted";
  Paint(1, kFirst);
  const ColorEdit edit = Edit();
  EditedPicture small = HandOut(1);
  small.image = Image8(20, 20);
  EXPECT_THROW(TakeBack(small), InputError);
  EXPECT_EQ(Edit(), edit) << "a refused picture leaves the edit";
  EditedPicture clean = HandOut(1);
  clean.image = clean.before;
  TakeBack(clean);
  EXPECT_TRUE(Found().layers.empty());
}

}  // namespace
}  // namespace retint
