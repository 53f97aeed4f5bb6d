// SPDX-License-Identifier: BSD-3-Clause
// The scene's answer about an outline on the ball before the wall.
#include "selecting/scene_answer.h"

#include <gtest/gtest.h>

#include "editing/edit_session.h"
#include "scene/mask_pixels.h"
#include "tests/editing/tiny_session.h"
#include "tests/support/iou.h"

namespace retint {
namespace {

Mask Rectangle(int x0, int y0, int x1, int y1) {
  Mask mask(160, 120);
  for (int y = y0; y < y1; ++y) {
    for (int x = x0; x < x1; ++x) mask(x, y) = 255;
  }
  return mask;
}

TEST(OutlinesDiffer, SpecksAndThinLinesDoNotCount) {
  const Mask whole = Rectangle(40, 30, 100, 90);
  EXPECT_FALSE(AnyInside(OutlinesDiffer(whole, whole)));
  EXPECT_FALSE(AnyInside(OutlinesDiffer(whole, Rectangle(41, 31, 99, 89)))) << "a border's width";
  Mask speck = whole;
  speck(20, 20) = 255;
  EXPECT_FALSE(AnyInside(OutlinesDiffer(whole, speck)));
  EXPECT_EQ(OutlinesDiffer(whole, Rectangle(40, 30, 90, 90)).data, Rectangle(90, 30, 100, 90).data);
  EXPECT_EQ(OutlinesDiffer(Rectangle(40, 30, 90, 90), whole).data, Rectangle(90, 30, 100, 90).data);
}

class AskSceneTest : public testing::Test {
 protected:
  // The ball in view 2, left of a column or not.
  Mask Part(bool left) const {
    Mask part = ball_;
    for (int y = 0; y < part.height; ++y) {
      for (int x = 0; x < part.width; ++x) {
        if ((x < column_) != left) part(x, y) = 0;
      }
    }
    return part;
  }
  // Until the left part has so much of the ball.
  void CutAt(double part) {
    column_ = 0;
    while (double(CountInside(Part(true))) < part * double(CountInside(ball_))) ++column_;
  }
  std::optional<SceneAnswer> Ask(const Mask& undecided) {
    const Pictures pictures = session_->scene().pictures();
    return AskScene(session_->selection(), pictures.RequireOne(world_.view(2).name), Part(true),
                    undecided, monitor_);
  }

  TinyWorld world_ = TinyWorld::Make(5, 600, 0.002, 7);
  const Mask ball_ = world_.BallMask(world_.Posed(2));
  std::unique_ptr<EditSession> session_ = TinySession(world_);
  Monitor monitor_;
  int column_ = 0;
};

TEST_F(AskSceneTest, WhatIsDecidedStaysAsItIs) {
  CutAt(0.85);
  const auto answer = Ask(Part(false));
  ASSERT_TRUE(answer);
  const Mask own = Part(true), open = Part(false);
  for (size_t p = 0; p < own.data.size(); ++p) {
    if (open.data[p] != 0) continue;
    ASSERT_EQ(answer->mask.data[p], own.data[p]) << p;
  }
  EXPECT_TRUE(answer->may_stand);
}

TEST_F(AskSceneTest, AnAnswerOfAnotherSizeMayNotStand) {
  CutAt(0.4);
  SceneAnswer answer;
  answer.may_stand = MayStandFor(Part(true), ball_);
  answer.changed = 1.5;
  EXPECT_FALSE(answer.IsWorthAsking());
  CutAt(0.85);
  answer.may_stand = MayStandFor(Part(true), ball_);
  EXPECT_TRUE(answer.IsWorthAsking());
  answer.changed = 0.01;
  EXPECT_FALSE(answer.IsWorthAsking());
}

}  // namespace
}  // namespace retint
