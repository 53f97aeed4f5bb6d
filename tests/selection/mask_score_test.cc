// SPDX-License-Identifier: BSD-3-Clause
// Figures worked out by hand.
#include "selection/mask_score.h"

#include <gtest/gtest.h>

#include "base/error.h"

namespace retint {
namespace {

Mask Rectangle(int width, int height, int x0, int y0, int x1, int y1) {
  Mask mask(width, height);
  for (int y = y0; y < y1; ++y) {
    for (int x = x0; x < x1; ++x) mask(x, y) = 255;
  }
  return mask;
}

TEST(MaskScore, CountsOverlap) {
  // 10 x 10 and 10 x 10, of which 5 x 10 are common.
  const MaskScore score =
      ScoreMask(Rectangle(30, 40, 5, 5, 15, 15), Rectangle(30, 40, 10, 5, 20, 15));
  EXPECT_DOUBLE_EQ(*score.iou, 50.0 / 150);
  EXPECT_DOUBLE_EQ(*score.precision, 0.5);
  EXPECT_DOUBLE_EQ(*score.recall, 0.5);
}

TEST(MaskScore, HalfIsInside) {
  Mask mask(2, 1), truth(2, 1, 255);
  mask.data = {127, 128};
  EXPECT_DOUBLE_EQ(*ScoreMask(mask, truth).recall, 0.5);
}

TEST(MaskScore, BoundaryLeavesOutTheInsides) {
  // The diagonal of 30 x 40 is 50: a margin of 0.02 is one pixel. Rings of 10 x 10 and of 12 x 10
  // whose left, upper and lower sides are common.
  const Mask small = Rectangle(30, 40, 5, 5, 15, 15), large = Rectangle(30, 40, 5, 5, 17, 15);
  const MaskScore score = ScoreMask(small, large);
  EXPECT_DOUBLE_EQ(*score.iou, 100.0 / 120);
  // The ring of `small` has 36 pixels, that of `large` 40; they share 10 on the left and 9 each
  // above and below: 28.
  EXPECT_DOUBLE_EQ(*score.boundary_iou, 28.0 / (36 + 40 - 28));
}

TEST(MaskScore, TheImagesEdgeIsABorder) {
  // Everything is inside: the ring along the edge of 30 x 40 is its boundary, in both.
  const Mask all(30, 40, 255);
  EXPECT_DOUBLE_EQ(*ScoreMask(all, all).boundary_iou, 1);
  // A hole in the middle of one adds the ring about it to that one's boundary alone: 136 along the
  // edge, and 8 around one pixel.
  Mask hole = all;
  hole(15, 20) = 0;
  EXPECT_DOUBLE_EQ(*ScoreMask(hole, all).boundary_iou, 136.0 / 144);
}

TEST(MaskScore, NothingIsNoFigure) {
  const Mask none(8, 8), some = Rectangle(8, 8, 2, 2, 4, 4);
  EXPECT_FALSE(ScoreMask(none, none).iou);
  EXPECT_FALSE(ScoreMask(none, none).boundary_iou);
  EXPECT_FALSE(ScoreMask(none, some).precision);
  EXPECT_EQ(ScoreMask(none, some).recall, 0);
  EXPECT_EQ(ScoreMask(none, some).iou, 0);
  EXPECT_FALSE(ScoreMask(some, none).recall);
  EXPECT_FALSE(Iou(none, none));
  EXPECT_EQ(Iou(some, some), 1);
  EXPECT_THROW(ScoreMask(none, Mask(8, 9)), OptionError);
}

void Set(Image* image, int x, int y, float r, float g, float b) {
  (*image)(x, y, 0) = r, (*image)(x, y, 1) = g, (*image)(x, y, 2) = b;
}

// 8 x 8 gray pixels of which 6 x 6 are to become red: 2 x 2 of them are two pixels from the border.
struct RedSquare {
  Image before{8, 8, 0.5f}, edited{8, 8, 0.5f}, after{8, 8, 0.5f};
  Mask truth = Rectangle(8, 8, 1, 1, 7, 7);

  RedSquare() {
    for (int y = 0; y < 8; ++y) {
      for (int x = 0; x < 8; ++x) Set(&edited, x, y, 1, 0.5f, 0.5f);
    }
  }
  EditScore Score(int border = 2) const { return ScoreEdit(before, edited, after, truth, border); }
};

TEST(EditScore, HitIsTheShareThatArrived) {
  RedSquare square;
  Set(&square.after, 3, 3, 1, 0.5f, 0.5f);      // all of it
  Set(&square.after, 4, 3, 0.75f, 0.5f, 0.5f);  // half
  Set(&square.after, 3, 4, 0.7f, 0.5f, 0.5f);   // 0.4
  Set(&square.after, 4, 4, 0.25f, 0.5f, 0.5f);  // the other way: none
  Set(&square.after, 1, 1, 0.25f, 0.5f, 0.5f);  // at the border: does not count
  const EditScore score = square.Score();
  EXPECT_NEAR(*score.hit, (1 + 0.5 + 0.4 + 0) / 4, 1e-6);  // float rounding
  EXPECT_DOUBLE_EQ(*score.missed, 0.5);
  EXPECT_EQ(score.leak, 0);
  EXPECT_EQ(score.stained, 0);
}

TEST(EditScore, MoreThanAskedForIsAHit) {
  RedSquare square;
  square.edited = Image(8, 8, 0.6f);
  square.after = Image(8, 8, 1.5f);  // shown as 1
  EXPECT_EQ(square.Score().hit, 1);
  EXPECT_EQ(square.Score().missed, 0);
}

TEST(EditScore, LeakAndStainsAreOutside) {
  RedSquare square;
  // 28 pixels are outside. One channel of one by 10 steps, one channel of another by 6.
  Set(&square.after, 0, 0, 0.5f + 10 / 255.0f, 0.5f, 0.5f);
  Set(&square.after, 7, 0, 0.5f, 0.5f - 6 / 255.0f, 0.5f);
  const EditScore score = square.Score();
  EXPECT_NEAR(*score.leak, (10 + 6) / 3.0 / 28, 1e-5);  // float rounding
  EXPECT_DOUBLE_EQ(*score.stained, 1.0 / 28);
}

TEST(EditScore, WhatWasNotToChangeSaysNothing) {
  RedSquare square;
  square.edited = square.before;
  EXPECT_FALSE(square.Score().hit);
  EXPECT_FALSE(square.Score().missed);
  square.truth = Mask(8, 8, 255);
  EXPECT_FALSE(square.Score().leak);
  EXPECT_FALSE(square.Score().stained);
}

TEST(EditScore, TheImagesEdgeIsNoBorderOfTheObject) {
  RedSquare square;
  square.truth = Mask(8, 8, 255);
  square.after = square.edited;
  Set(&square.after, 0, 0, 0.5f, 0.5f, 0.5f);  // one of 64 pixels
  EXPECT_NEAR(*square.Score().hit, 63.0 / 64, 1e-6);
}

}  // namespace
}  // namespace retint
