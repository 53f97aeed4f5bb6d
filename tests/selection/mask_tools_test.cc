// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include <gtest/gtest.h>

#include "base/error.h"
#include "scene/mask_pixels.h"
#include "selection/mask_score.h"
#include "selection/mask_tools/paint_border.h"
#include "selection/mask_tools/pixel_tools.h"
#include "selection/mask_tools/scissors.h"
#include "selection/mask_tools/scribbles.h"

namespace retint {
namespace {

constexpr int kWidth = 120, kHeight = 90;
constexpr double kCenterX = 60, kCenterY = 45, kRadius = 25;

double FromCenter(double x, double y) { return std::hypot(x + 0.5 - kCenterX, y + 0.5 - kCenterY); }

// A disc before a wall; `rgb` of both, a little noise, and the disc's depth (the wall's is 4).
ViewLayers Disc(const std::array<float, 3>& disc, const std::array<float, 3>& wall, float depth) {
  ViewLayers layers;
  layers.camera.camera = Camera::Pinhole(1, kWidth, kHeight, 100, 100, kWidth / 2.0, kHeight / 2.0);
  layers.color = Image(kWidth, kHeight);
  layers.depth = DepthMap(kWidth, kHeight, 4);
  std::mt19937 random(7);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const bool in = FromCenter(x, y) < kRadius;
      const float noise = 0.02f * (float(random() >> 8) * 0x1p-24f - 0.5f);
      for (int c = 0; c < 3; ++c) {
        layers.color(x, y, c) = (in ? disc : wall)[size_t(c)] + noise;
      }
      if (in) layers.depth(x, y) = depth;
    }
  }
  return layers;
}

Mask DiscMask(double radius) {
  Mask mask(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) mask(x, y) = FromCenter(x, y) < radius ? 255 : 0;
  }
  return mask;
}

Mask Stroke(const std::vector<Eigen::Vector2d>& points, double brush = 4) {
  Mask mask(kWidth, kHeight);
  DrawStroke(points, brush, &mask);
  return mask;
}

const std::array<float, 3> kRed = {0.7f, 0.2f, 0.2f}, kGray = {0.5f, 0.5f, 0.5f};

TEST(Scribbles, AStrokeIsAsWideAsItsBrush) {
  const Mask line = Stroke({{20, 45}, {80, 45}}, 6);
  EXPECT_EQ(line(50, 42), 255);  // centers at 42.5 and 47.5 lie within 3 of 45
  EXPECT_EQ(line(50, 47), 255);
  EXPECT_EQ(line(50, 41), 0);
  EXPECT_EQ(line(50, 48), 0);
  EXPECT_EQ(line(17, 45), 255);  // the round end
  EXPECT_EQ(line(16, 45), 0);
  EXPECT_EQ(Stroke({{5, 5}}, 0.5)(5, 5), 0);  // its center is 0.7 away
  EXPECT_EQ(Stroke({{5.5, 5.5}}, 0.5)(5, 5), 255);
  EXPECT_EQ(Stroke({{-500, -500}, {500, 500}}, 2)(40, 40), 255);
}

TEST(Scribbles, FindTheOutlineByColorAlone) {
  Monitor monitor;
  ViewLayers layers = Disc(kRed, kGray, 4);
  layers.depth = {};
  const Mask mask = MaskFromScribbles(layers, Stroke({{50, 45}, {70, 45}}),
                                      Stroke({{10, 10}, {110, 10}, {110, 80}}), monitor);
  EXPECT_GT(*Iou(mask, DiscMask(kRadius)), 0.97);  // its edge is one pixel wide
}

TEST(Scribbles, FindTheOutlineByDepthAlone) {
  Monitor monitor;
  const Mask mask = MaskFromScribbles(Disc(kGray, kGray, 3), Stroke({{50, 45}, {70, 45}}),
                                      Stroke({{10, 10}, {110, 10}, {110, 80}}), monitor);
  EXPECT_GT(*Iou(mask, DiscMask(kRadius)), 0.95);
}

TEST(Scribbles, WithoutStrokesOutsideThePicturesEdgeIs) {
  Monitor monitor;
  const Mask mask =
      MaskFromScribbles(Disc(kRed, kGray, 3), Stroke({{50, 45}, {70, 45}}), {}, monitor);
  EXPECT_GT(*Iou(mask, DiscMask(kRadius)), 0.97);
}

// A stroke outside on a dark board teaches nothing of the wall, which is more like the disc.
TEST(Scribbles, TheBorderLooksOutsideThoughAStrokeOutsideIsElsewhere) {
  Monitor monitor;
  ViewLayers layers = Disc(kRed, {0.75f, 0.4f, 0.35f}, 4);
  for (int y = 60; y < 85; ++y) {
    for (int x = 30; x < 90; ++x) {
      if (FromCenter(x, y) < kRadius) continue;
      for (int c = 0; c < 3; ++c) layers.color(x, y, c) = 0.1f + 0.002f * float((x + y) % 5);
    }
  }
  const Mask mask = MaskFromScribbles(layers, Stroke({{50, 40}, {70, 45}}),
                                      Stroke({{55, 78}, {65, 78}}), monitor);
  EXPECT_GT(*Iou(mask, DiscMask(kRadius)), 0.9);
}

TEST(Scribbles, KeepsWhatTheStrokesSay) {
  Monitor monitor;
  // A stroke outside on the disc itself: its pixels are outside.
  const Mask inside = Stroke({{50, 40}, {70, 40}}), outside = Stroke({{50, 60}, {70, 60}});
  const Mask mask = MaskFromScribbles(Disc(kRed, kGray, 3), inside, outside, monitor);
  for (size_t p = 0; p < mask.data.size(); ++p) {
    if (inside.data[p]) {
      EXPECT_EQ(mask.data[p], 255);
    }
    if (outside.data[p]) {
      EXPECT_EQ(mask.data[p], 0);
    }
  }
}

TEST(Scribbles, MayCoverEveryPixel) {
  Monitor monitor;
  const Mask disc = DiscMask(kRadius), all(kWidth, kHeight, 255);
  Mask rest = disc;
  for (uint8_t& value : rest.data) value = uint8_t(255 - value);
  const ViewLayers layers = Disc(kRed, kGray, 3);
  EXPECT_EQ(MaskFromScribbles(layers, disc, rest, monitor).data, disc.data);
  EXPECT_EQ(MaskFromScribbles(layers, all, {}, monitor).data, all.data);
}

TEST(Scribbles, EndWhereTwoSurfacesMeetInAValley) {
  Monitor monitor;
  // Two gray planes at 90 degrees that meet at column 60, z = 3 / (1 + |u|).
  ViewLayers layers = Disc(kGray, kGray, 4);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      layers.depth(x, y) = float(3 / (1 + std::abs((x + 0.5 - kCenterX) / 100)));
    }
  }
  Mask left(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) std::fill_n(&left(0, y), 60, uint8_t{255});
  // The stroke outside is four times as near to the valley as the one inside.
  const Mask mask = MaskFromScribbles(layers, Stroke({{20, 20}, {20, 70}}),
                                      Stroke({{70, 20}, {70, 70}}), monitor);
  EXPECT_GT(*Iou(mask, left), 0.93);
}

TEST(Scribbles, SayWhatTheViewDoesNotDecide) {
  Monitor monitor;
  const Mask inside = Stroke({{50, 45}, {70, 45}});
  const Mask outside = Stroke({{10, 10}, {110, 10}, {110, 80}});
  const auto undecided = [&](const ViewLayers& layers) {
    Mask mask;
    MaskFromScribbles(layers, inside, outside, monitor, &mask);
    return mask;
  };
  const auto fraction = [](const Mask& mask) {
    return double(std::count(mask.data.begin(), mask.data.end(), 255)) / double(mask.NumPixels());
  };
  const Mask clear = undecided(Disc(kRed, kGray, 3)), vague = undecided(Disc(kGray, kGray, 4));
  ASSERT_EQ(clear.width, kWidth);
  EXPECT_LT(fraction(clear), 0.04);  // the outline is 1.5 % of the pixels, of which few may move
  EXPECT_GT(fraction(vague), 0.1);   // nothing shows where the one ends and the other begins
  for (size_t p = 0; p < vague.data.size(); ++p) {
    if (inside.data[p] || outside.data[p]) {
      EXPECT_EQ(vague.data[p], 0);
    }
  }
}

// A red disc, and a patch of its color and depth that does not touch it, around (107, 12).
ViewLayers DiscAndPatch() {
  ViewLayers layers = Disc(kRed, kGray, 3);
  for (int y = 5; y < 20; ++y) {
    for (int x = 100; x < 115; ++x) {
      for (int c = 0; c < 3; ++c) layers.color(x, y, c) = kRed[size_t(c)];
      layers.depth(x, y) = 3;
    }
  }
  return layers;
}

TEST(Scribbles, LeaveOpenWhatIsAlikeButNotConnected) {
  Monitor monitor;
  const ViewLayers layers = DiscAndPatch();
  Mask undecided;
  const Mask mask = MaskFromScribbles(layers, Stroke({{50, 45}, {70, 45}}),
                                      Stroke({{10, 10}, {10, 80}, {110, 80}}), monitor, &undecided);
  EXPECT_LT(mask(107, 12), 128);
  EXPECT_EQ(undecided(107, 12), 255);
}

TEST(Scribbles, LeavesASecondDiscAlone) {
  Monitor monitor;
  const ViewLayers layers = DiscAndPatch();
  const Mask mask = MaskFromScribbles(layers, Stroke({{50, 45}, {70, 45}}),
                                      Stroke({{10, 10}, {10, 80}, {110, 80}}), monitor);
  EXPECT_LT(mask(107, 12), 128);
  EXPECT_GT(*Iou(mask, DiscMask(kRadius)), 0.95);
}

TEST(Scribbles, LeavesARibbonOfItsColorOnTheWallBehind) {
  Monitor monitor;
  ViewLayers layers = Disc(kRed, kGray, 3);
  for (int y = 4; y < kHeight; ++y) {
    for (int x = 52; x < 68; ++x) {
      if (FromCenter(x, y) < kRadius || y > kCenterY) continue;
      for (int c = 0; c < 3; ++c) layers.color(x, y, c) = kRed[size_t(c)];
    }
  }
  const Mask mask = MaskFromScribbles(layers, Stroke({{50, 45}, {70, 45}}),
                                      Stroke({{10, 10}, {10, 80}, {110, 80}}), monitor);
  EXPECT_LT(mask(60, 12), 128);
  EXPECT_GT(*Iou(mask, DiscMask(kRadius)), 0.95);
}

TEST(Scribbles, RefusesStrokesThatContradict) {
  Monitor monitor;
  const ViewLayers layers = Disc(kRed, kGray, 3);
  const Mask stroke = Stroke({{50, 45}, {70, 45}});
  EXPECT_THROW(MaskFromScribbles(layers, stroke, stroke, monitor), OptionError);
  EXPECT_THROW(MaskFromScribbles(layers, Mask(kWidth, kHeight), stroke, monitor), OptionError);
  EXPECT_THROW(MaskFromScribbles(layers, Mask(3, 3), {}, monitor), OptionError);
  EXPECT_THROW(MaskFromScribbles({}, {}, {}, monitor), OptionError);
  monitor.Cancel();
  EXPECT_THROW(MaskFromScribbles(layers, stroke, {}, monitor), Cancelled);
}

TEST(RefineEdge, MovesARoughBorderToTheEdge) {
  Monitor monitor;
  const ViewLayers layers = Disc(kRed, kGray, 3);
  const Mask truth = DiscMask(kRadius);
  for (const double radius : {kRadius - 4, kRadius + 4}) {
    const Mask rough = DiscMask(radius), refined = RefineEdge(layers, rough, 7, monitor);
    EXPECT_LT(*Iou(rough, truth), 0.8);
    EXPECT_GT(*Iou(refined, truth), 0.96);
    // Beyond the band nothing changes.
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        if (std::abs(FromCenter(x, y) - radius) < 9) continue;
        EXPECT_EQ(refined(x, y), rough(x, y)) << x << " " << y;
      }
    }
  }
}

TEST(RefineEdge, LeavesWhatHasNoBorder) {
  Monitor monitor;
  const ViewLayers layers = Disc(kRed, kGray, 3);
  const Mask none(kWidth, kHeight), all(kWidth, kHeight, 255);
  EXPECT_EQ(RefineEdge(layers, none, 5, monitor).data, none.data);
  EXPECT_EQ(RefineEdge(layers, all, 5, monitor).data, all.data);
  EXPECT_THROW(RefineEdge(layers, all, 0, monitor), OptionError);
}

// `mask` plus the missed pixels at its border.
Mask Grown(const ViewLayers& layers, Mask mask, int reach) {
  Monitor monitor;
  const Mask left_out = FindMissedBorder(layers, mask, reach, monitor).left_out;
  for (size_t p = 0; p < mask.data.size(); ++p) {
    if (left_out.data[p] > 0) {
      EXPECT_LT(mask.data[p], 128);
      mask.data[p] = 255;
    }
  }
  return mask;
}

TEST(PaintBorder, LeavesOutWhatLiesBeforeAnEdgeOfColorOrDepth) {
  for (const ViewLayers& layers :
       {Disc(kRed, kGray, 4), Disc(kGray, kGray, 3), Disc(kRed, kGray, 3)}) {
    const Mask truth = DiscMask(kRadius);
    for (const double less : {2.0, 3.0, 4.0}) {
      EXPECT_GT(*Iou(Grown(layers, DiscMask(kRadius - less), 5), truth), 0.96) << less;
    }
  }
}

// Paint with a hand that shakes goes beyond the edge, too.
TEST(PaintBorder, SpillsBeyondAnEdgeOfColorOrDepth) {
  Monitor monitor;
  for (const ViewLayers& layers :
       {Disc(kRed, kGray, 4), Disc(kGray, kGray, 3), Disc(kRed, kGray, 3)}) {
    for (const double more : {2.0, 3.0, 4.0}) {
      Mask mask = DiscMask(kRadius + more);
      const MissedBorder missed = FindMissedBorder(layers, mask, 5, monitor);
      for (size_t p = 0; p < mask.data.size(); ++p) {
        if (missed.spilled.data[p] == 0) continue;
        EXPECT_GE(mask.data[p], 128);
        mask.data[p] = 0;
      }
      EXPECT_GT(*Iou(mask, DiscMask(kRadius)), 0.96) << more;
      EXPECT_FALSE(AnyInside(missed.left_out)) << more;
    }
  }
}

TEST(PaintBorder, MissesNothingWherePaintEndsAtTheEdge) {
  Monitor monitor;
  const MissedBorder missed = FindMissedBorder(Disc(kRed, kGray, 3), DiscMask(kRadius), 5, monitor);
  EXPECT_FALSE(AnyInside(missed.left_out));
  EXPECT_FALSE(AnyInside(missed.spilled));
}

// Paint on a part of a plain surface ends where the painter wanted it to.
TEST(PaintBorder, MissesNothingOnAPlainSurface) {
  Monitor monitor;
  const ViewLayers layers = Disc(kRed, kGray, 3);
  const auto is_plain = [&](const Mask& mask) {
    const MissedBorder missed = FindMissedBorder(layers, mask, 5, monitor);
    return !AnyInside(missed.left_out) && !AnyInside(missed.spilled);
  };
  EXPECT_TRUE(is_plain(DiscMask(kRadius - 10)));
  EXPECT_TRUE(is_plain(DiscMask(kRadius + 10)));
  Mask corner(kWidth, kHeight), stripe(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      corner(x, y) = x < 25 && y < 30 ? 255 : 0;
      stripe(x, y) = x > 100 && x < 108 ? 255 : 0;
    }
  }
  EXPECT_TRUE(is_plain(corner));
  EXPECT_TRUE(is_plain(stripe));
  // Half a disc goes on to the edge around it and hardly over the line that divides it.
  Mask half = DiscMask(kRadius - 3);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 60; x < kWidth; ++x) half(x, y) = 0;
  }
  const Mask grown = Grown(layers, half, 5);
  int across = 0;
  for (int y = 0; y < kHeight; ++y) across += grown(62, y) > 0;
  EXPECT_LT(across, 20);  // of 50: at the line's two ends, where the edge is near
  EXPECT_EQ(grown(36, 45), 255);
}

TEST(PaintBorder, HasNoneWhereNothingOrAllIsPainted) {
  Monitor monitor;
  const ViewLayers layers = Disc(kRed, kGray, 3);
  for (const uint8_t value : {0, 255}) {
    const MissedBorder missed = FindMissedBorder(layers, Mask(kWidth, kHeight, value), 5, monitor);
    EXPECT_FALSE(AnyInside(missed.left_out));
    EXPECT_FALSE(AnyInside(missed.spilled));
  }
}

TEST(FarFromBorder, LeavesOutABandOnBothSides) {
  Mask mask(40, 20);
  for (int y = 0; y < 20; ++y) std::fill_n(&mask(0, y), 15, 200);  // the border is at x = 15
  const ScalarImage far = FarFromBorder(mask, 3);
  for (int x = 0; x < 40; ++x) EXPECT_EQ(far(x, 10), x < 12 || x >= 18 ? 1 : 0) << x;
  const ScalarImage all = FarFromBorder(mask, 0);
  EXPECT_EQ(std::count(all.data.begin(), all.data.end(), 1.0f), 40 * 20);
}

TEST(MagicWand, StopsAtColorsStepsAndBends) {
  const Mask disc = DiscMask(kRadius);
  WandOptions wand;
  wand.x = 60, wand.y = 45;
  EXPECT_GT(*Iou(MagicWand(Disc(kRed, kGray, 4), wand), disc), 0.97);   // by color
  EXPECT_GT(*Iou(MagicWand(Disc(kGray, kGray, 3), wand), disc), 0.97);  // by depth
  const Mask all = MagicWand(Disc(kGray, kGray, 4), wand);
  EXPECT_EQ(std::count(all.data.begin(), all.data.end(), 255), kWidth * kHeight);
  // A roof with its ridge at column 60: the two sides meet without a step.
  ViewLayers roof = Disc(kGray, kGray, 4);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      // z = 3 + |X| with X = z u: both sides are planes at 90 degrees to each other.
      const double u = std::abs((x + 0.5 - 60) / 100);
      roof.depth(x, y) = float(3 / (1 - u));
    }
  }
  wand.x = 20, wand.normal = 40;
  const Mask side = MagicWand(roof, wand);
  EXPECT_EQ(side(30, 45), 255);
  EXPECT_EQ(side(90, 45), 0);
  wand.normal = 180;
  EXPECT_EQ(MagicWand(roof, wand)(90, 45), 255);
}

// Light that comes from far behind makes a mean depth of steps; the surface itself has none.
TEST(MagicWand, FollowsTheSurfaceThoughItLetsLightThrough) {
  ViewLayers layers = Disc(kRed, kGray, 4);
  layers.surface = layers.depth;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) layers.depth(x, y) *= 1 + 0.2f * float((x + y) % 3);
  }
  const WandOptions wand{.x = int(kCenterX), .y = int(kCenterY)};
  EXPECT_GT(*Iou(MagicWand(layers, wand), DiscMask(kRadius)), 0.97);
  layers.surface = {};
  EXPECT_LT(*Iou(MagicWand(layers, wand), DiscMask(kRadius)), 0.1);
}

TEST(MagicWand, RefusesPlacesOutside) {
  const ViewLayers layers = Disc(kRed, kGray, 3);
  EXPECT_THROW(MagicWand(layers, {.x = kWidth, .y = 0}), OptionError);
  EXPECT_THROW(MagicWand(layers, {.x = -1, .y = 0}), OptionError);
  EXPECT_THROW(MagicWand(layers, {.x = 1, .y = 1, .color = -1}), OptionError);
}

TEST(PixelTools, LikeAColorIsNotConnected) {
  ViewLayers layers = Disc(kRed, kGray, 3);
  for (int c = 0; c < 3; ++c) layers.color(2, 2, c) = kRed[size_t(c)];
  const Mask mask = LikeColor(layers, ColorAt(layers, 60, 45), 0.05);
  EXPECT_EQ(mask(2, 2), 255);
  EXPECT_EQ(mask(4, 4), 0);
  EXPECT_EQ(mask(60, 45), 255);
}

TEST(PixelTools, SolidsCutTheSurface) {
  const ViewLayers layers = Disc(kRed, kGray, 3);
  // The disc's surface is at z = 3, where a pixel is 0.03 wide. A sphere of 0.5 about its center
  // covers a circle of 16.7 pixels, and nothing of the wall.
  const Mask sphere = InSphere(layers, {0, 0, 3}, 0.5);
  EXPECT_GT(*Iou(sphere, DiscMask(0.5 / 0.03)), 0.999);
  // To the right of the middle, wall and disc.
  const Mask box = InBox(layers, {0, -10, 0}, {10, 10, 10});
  EXPECT_EQ(box(59, 45), 0);
  EXPECT_EQ(box(60, 45), 255);
  EXPECT_EQ(box(119, 0), 255);
  const Mask both = Intersection(sphere, box);
  EXPECT_EQ(both(50, 45), 0);
  EXPECT_EQ(both(70, 45), 255);
  EXPECT_EQ(both(100, 45), 0);
  EXPECT_THROW(InSphere(layers, {0, 0, 3}, 0), OptionError);
  EXPECT_THROW(InBox(layers, {0, 0, 0}, {1, 0, 1}), OptionError);
  ViewLayers flat = layers;
  flat.depth = {};
  EXPECT_THROW(InSphere(flat, {0, 0, 3}, 1), OptionError);
}

TEST(Scissors, CutAlongEdges) {
  const ViewLayers layers = Disc(kRed, kGray, 3);
  // Four points near the circle; straight lines between them would enclose two thirds of it.
  const Mask mask = CutOut(layers.color, {{60, 20}, {85, 45}, {60, 70}, {35, 45}});
  EXPECT_GT(*Iou(mask, DiscMask(kRadius)), 0.9);  // a pixel all around is 0.08
  EXPECT_THROW(CutOut(layers.color, {{60, 20}, {85, 45}}), OptionError);
  EXPECT_THROW(CutOut(layers.color, {{60, 20}, {85, 45}, {500, 5}}), OptionError);
}

TEST(Scissors, RunStraightWhereThereIsNoEdge) {
  Image plain(kWidth, kHeight);
  std::fill(plain.data.begin(), plain.data.end(), 0.5f);
  const Mask mask = CutOut(plain, {{10, 10}, {100, 25}, {90, 80}, {20, 60}});
  Mask straight(kWidth, kHeight);
  const Eigen::Vector2d corners[] = {{10, 10}, {100, 25}, {90, 80}, {20, 60}};
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      bool in = true;
      for (int i = 0; i < 4; ++i) {
        const Eigen::Vector2d along = corners[(i + 1) % 4] - corners[i];
        const Eigen::Vector2d at = Eigen::Vector2d(x, y) - corners[i];
        in = in && along.x() * at.y() - along.y() * at.x() >= 0;
      }
      straight(x, y) = in ? 255 : 0;
    }
  }
  EXPECT_GT(*Iou(mask, straight), 0.97);  // a pixel all around is 0.06
}

// A frame of strong edges about two points must not lead the line between them astray.
TEST(Scissors, StayBesideTheLineBetweenTwoPoints) {
  Image picture(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const bool in = x >= 40 && x < 80 && y >= 5 && y < 85;
      for (int c = 0; c < 3; ++c) picture(x, y, c) = in ? 0.9f : 0.1f;
    }
  }
  // The upper side of the outline crosses the bright bar 40 pixels below its top.
  const Mask mask = CutOut(picture, {{40, 45}, {79, 45}, {79, 84}, {40, 84}});
  for (int x = 45; x < 75; ++x) {
    EXPECT_EQ(mask(x, 30), 0) << x;
    EXPECT_EQ(mask(x, 60), 255) << x;
  }
}

// An edge makes a detour around the line from (20, 75) to (100, 75). A third of that is 26.7.
TEST(Scissors, FollowEdgesUpToAThirdOfTheLineAway) {
  for (const int away : {25, 28}) {
    Image picture(kWidth, kHeight);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const bool in = y >= (x >= 30 && x < 90 ? 75 - away : 75);
        for (int c = 0; c < 3; ++c) picture(x, y, c) = in ? 0.9f : 0.1f;
      }
    }
    const Mask mask = CutOut(picture, {{20, 75}, {100, 75}, {100, 85}, {20, 85}});
    EXPECT_EQ(mask(60, 80), 255) << away;
    EXPECT_EQ(mask(60, 60), away == 25 ? 255 : 0) << away;
  }
}

}  // namespace
}  // namespace retint
