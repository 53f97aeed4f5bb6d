// SPDX-License-Identifier: BSD-3-Clause
// Paint on a picture, tested by known differences.
#include "editing/picture_changes.h"
#include "opening/picture_likeness.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace retint {
namespace {

constexpr int kWidth = 200, kHeight = 160;

// Something to see, of which a picture is made: waves of gray in a direction of their own, as 8
// bits hold them.
Image Scene(double angle) {
  Image image(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double along = std::cos(angle) * x + std::sin(angle) * y;
      const double gray = std::round(255 * (0.5 + 0.3 * std::sin(along / 9))) / 255;
      for (int c = 0; c < 3; ++c) image(x, y, c) = float(gray);
    }
  }
  return image;
}

template <typename Change>
Image8 Picture(const Image& image, const Change& change) {
  Image8 picture(image.width, image.height);
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      for (int c = 0; c < 3; ++c) {
        picture(x, y, c) =
            uint8_t(std::lround(255 * std::clamp(change(x, y, image(x, y, c)), 0.0, 1.0)));
      }
    }
  }
  return picture;
}

Mask Disk(int radius) {
  Mask mask(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      mask(x, y) = std::hypot(x - kWidth / 2, y - kHeight / 2) < radius ? 255 : 0;
    }
  }
  return mask;
}

TEST(PictureChanges, NoiseIsNoChange) {
  const Image view = Scene(0.3);
  const Image8 same = Picture(view, [](int, int, double value) { return value; });
  EXPECT_FLOAT_EQ(LeastChange(same, view), 2);
  std::mt19937 rng(1);
  std::normal_distribution<double> noise(0, 0.012);
  const Image8 noisy = Picture(view, [&](int, int, double value) { return value + noise(rng); });
  const float least = LeastChange(noisy, view);
  EXPECT_GT(least, 3);
  // A flat background of a JPEG has no noise; paint on a picture without any is none.
  const auto right = [&](double from) {
    return Picture(view, [&](int x, int, double value) {
      return x < from * kWidth ? value : value + noise(rng);
    });
  };
  EXPECT_GT(LeastChange(right(0.6), view), 3);
  EXPECT_FLOAT_EQ(LeastChange(right(0.9), view), 2);
  // However much is graded, that is no noise.
  const Image8 graded = Picture(view, [](int, int, double value) { return 0.6 * value + 0.3; });
  EXPECT_LT(LeastChange(graded, view), 3);
}

TEST(PictureChanges, TheSameViewIsKnownByItsEdges) {
  const Image view = Scene(0.3);
  const Image8 inverted = Picture(view, [](int, int, double value) { return 1 - 0.7 * value; });
  EXPECT_GT(EdgeCorrelation(inverted, view), 0.9);
  EXPECT_LT(EdgeCorrelation(inverted, Scene(1.7)), 0.3);
}

// Inside a mask everything may differ; the pixels beside it decide.
TEST(PictureChanges, TheSameViewIsKnownBesideTheMask) {
  const Image view = Scene(0.3), other = Scene(1.7);
  Mask mask(kWidth, kHeight);
  for (int y = 20; y < kHeight - 20; ++y) {
    for (int x = 20; x < kWidth - 20; ++x) mask(x, y) = 255;
  }
  const auto repainted = [&](const Image& beside) {
    return Picture(beside, [&](int x, int y, double value) {
      return mask(x, y) ? double(x / 10 % 2) : 1 - 0.7 * value;
    });
  };
  EXPECT_LT(EdgeCorrelation(repainted(view), view), 0.35);
  EXPECT_GT(EdgeCorrelation(repainted(view), view, mask), 0.9);
  EXPECT_LT(EdgeCorrelation(repainted(other), view, mask), 0.3);
  // Of a flat background, and of next to nothing beside the mask, the whole picture tells.
  Image before(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      for (int c = 0; c < 3; ++c) before(x, y, c) = mask(x, y) ? view(x, y, c) : 0.5f;
    }
  }
  // The object stands elsewhere in it.
  const Image8 elsewhere =
      Picture(other, [](int x, int, double value) { return x < 50 ? value : 0.5; });
  const Mask all(kWidth, kHeight, 255);
  EXPECT_LT(EdgeCorrelation(elsewhere, before, mask), 0.3);
  EXPECT_LT(
      EdgeCorrelation(Picture(other, [](int, int, double value) { return value; }), view, all),
      0.3);
}

TEST(PictureChanges, SurroundingsGoAroundTheMask) {
  const Mask mask = Disk(30), around = Surroundings(mask);
  for (int x = 0; x < kWidth; ++x) {
    const int distance = std::abs(x - kWidth / 2);
    if (distance < 30 || distance > 36) {
      EXPECT_EQ(around(x, kHeight / 2), 0) << x;
    }
    if (distance > 30 && distance < 34) {
      EXPECT_EQ(around(x, kHeight / 2), 255) << x;
    }
  }
}

// A ring along the end disappears. A spot stays, with its part of the ring.
TEST(PictureChanges, AThinStripAlongTheEndIsNoPaint) {
  const Mask inside = Disk(40);
  const ScalarImage least(kWidth, kHeight, 2);
  ScalarImage difference(kWidth, kHeight);
  const auto from_spot = [](int x, int y) {
    return std::hypot(x - kWidth / 2 - 32, y - kHeight / 2);
  };
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double radius = std::hypot(x - kWidth / 2, y - kHeight / 2);
      if ((radius > 37 && radius < 40) || (radius < 40 && from_spot(x, y) < 9)) {
        difference(x, y) = 20;
      }
    }
  }
  DropRim(difference, least, inside);
  EXPECT_EQ(difference(kWidth / 2 - 38, kHeight / 2), 0);
  EXPECT_EQ(difference(kWidth / 2, kHeight / 2 + 38), 0);
  EXPECT_EQ(difference(kWidth / 2 + 26, kHeight / 2), 20);
  EXPECT_EQ(difference(kWidth / 2 + 38, kHeight / 2), 20);
}

// A disc before a wall, painted four pixels too wide; and a rod of the same depth as the wall that
// was painted on purpose.
TEST(PictureChanges, WhatABrushTouchedBehindIsNotSelected) {
  DepthMap depth(kWidth, kHeight);
  Mask mask = Disk(34);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double radius = std::hypot(x - kWidth / 2, y - kHeight / 2);
      // A ball's front.
      depth(x, y) = radius < 30 ? float(4 - std::sqrt(900 - radius * radius) / 150) : 5;
      if (x > kWidth / 2 && std::abs(y - kHeight / 2) < 3) mask(x, y) = 255;
    }
  }
  const Mask kept = WithoutSpill(mask, depth);
  EXPECT_EQ(kept(kWidth / 2 - 29, kHeight / 2), 255);
  EXPECT_EQ(kept(kWidth / 2 + 60, kHeight / 2), 255);
  mask = Disk(34);
  const Mask alone = WithoutSpill(mask, depth);
  int beyond = 0, lost = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double radius = std::hypot(x - kWidth / 2, y - kHeight / 2);
      beyond += radius > 31 && alone(x, y) ? 1 : 0;
      lost += radius < 29 && !alone(x, y) ? 1 : 0;
    }
  }
  EXPECT_EQ(beyond, 0);
  EXPECT_EQ(lost, 0);
}

// At the end of the selection, the paint goes on; at its own end, it does not.
TEST(PictureChanges, PaintGoesOnBeyondTheSelection) {
  const Mask inside = Disk(40);
  ScalarImage difference(kWidth, kHeight);
  Image8 picture(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const bool painted = inside(x, y) > 0 && x < kWidth / 2;
      if (painted) difference(x, y) = 20;
      for (int c = 0; c < 3; ++c) picture(x, y, c) = painted ? 200 : 30;
    }
  }
  // One column that happens to be as before, as a gap.
  for (int y = 0; y < kHeight; ++y) difference(80, y) = 0;
  const ScalarImage least(kWidth, kHeight, 2);
  const auto layer = PaintedLayer("view", picture, difference, least, inside);
  ASSERT_TRUE(layer);
  const auto alpha = [&](int x, int y) {
    return layer->alpha.Contains(x - layer->x, y - layer->y)
               ? layer->alpha(x - layer->x, y - layer->y)
               : 0;
  };
  const int y = kHeight / 2, left = kWidth / 2 - 40;
  EXPECT_EQ(alpha(80, y), 255);
  EXPECT_EQ(alpha(left - 1, y), 255);
  EXPECT_EQ(layer->color(left - 1 - layer->x, y - layer->y, 0), 200);
  EXPECT_EQ(alpha(left - 4, y), 0);
  EXPECT_EQ(alpha(kWidth / 2 + 2, y), 0);
  EXPECT_FALSE(PaintedLayer("view", picture, ScalarImage(kWidth, kHeight), least, inside));
}

}  // namespace
}  // namespace retint
