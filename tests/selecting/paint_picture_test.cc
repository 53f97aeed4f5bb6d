// SPDX-License-Identifier: BSD-3-Clause
// The effect of paint, in figures and as a picture.
#include "selecting/paint_picture.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "base/error.h"
#include "editing/edit_session.h"
#include "scene/mask_pixels.h"
#include "tests/editing/tiny_session.h"

namespace retint {
namespace {

Mask Row(std::initializer_list<uint8_t> values) {
  Mask mask(int(values.size()), 1);
  std::copy(values.begin(), values.end(), mask.data.begin());
  return mask;
}

// Six pixels: kept twice, left out, added, neither, and one that the painter did not see.
PaintedView SixPixels() {
  PaintedView view;
  view.name = "six";
  view.camera.camera = Camera::Pinhole(1, 6, 1, 6, 6, 3, 0.5);
  view.mask = Row({255, 255, 255, 0, 0, 255});
  view.seen = Row({255, 255, 255, 255, 255, 0});
  return view;
}
const Mask kMask = Row({255, 128, 127, 255, 0, 0});

TEST(PaintPicture, CountsPixelsThatThePainterSaw) {
  const PaintCounts counts = CountPaint(SixPixels(), kMask);
  EXPECT_EQ(counts.painted, 3u);
  EXPECT_EQ(counts.kept, 2u);
  EXPECT_EQ(counts.added, 1u);
  EXPECT_EQ(counts.left_out(), 1u);
  EXPECT_EQ(CountPaint(SixPixels(), Mask(5, 1)).painted, 0u) << "of another size";
  PaintCounts twice = counts;
  twice += counts;
  EXPECT_EQ(twice.painted, 6u);
  EXPECT_EQ(twice.added, 2u);
}

TEST(PaintPicture, SaysTheFiguresInWords) {
  EXPECT_EQ(PaintCounts().Words(), "");
  EXPECT_EQ((PaintCounts{1000, 995, 5}.Words()), "all of your paint is in");
  EXPECT_EQ((PaintCounts{1000, 930, 0}.Words()), "93 % of your paint is in");
  EXPECT_EQ((PaintCounts{1000, 930, 41}.Words()), "93 % of your paint is in, and 4 % beside it");
}

TEST(PaintPicture, ColorsAgreeWithTheCounts) {
  Image photo(6, 1);
  photo.data.assign(photo.data.size(), 0.5F);
  const Image8 picture = PaintPicture(photo, SixPixels(), kMask);
  size_t green = 0, yellow = 0, red = 0, gray = 0;
  for (int x = 0; x < 6; ++x) {
    const int r = picture(x, 0, 0), g = picture(x, 0, 1), b = picture(x, 0, 2);
    green += g > r + 40 && g > b + 40;
    yellow += r > b + 40 && g > b + 40;
    red += r > g + 40 && r > b + 40;
    gray += r == g && g == b;
  }
  const PaintCounts counts = CountPaint(SixPixels(), kMask);
  EXPECT_EQ(green, counts.kept);
  EXPECT_EQ(yellow, counts.added);
  EXPECT_EQ(red, counts.left_out());
  EXPECT_EQ(gray, 2u) << "what is neither, and what was not seen";
  EXPECT_THROW(PaintPicture(Image(5, 1), SixPixels(), kMask), InputError);
}

TEST(PaintPicture, ThereIsOneOfEachPaintedViewWithAMask) {
  const TinyWorld world = TinyWorld::Make(5, 600, 0.002, 7);
  const auto session = TinySession(world);
  std::vector<PaintedView> painted;
  for (const int v : {3, 1}) {
    painted.push_back({world.view(v).name, world.Posed(v), world.BallMask(world.Posed(v))});
  }
  painted.push_back({"free view 1", world.Posed(0), world.BallMask(world.Posed(0))});
  std::map<std::string, Mask> masks;
  for (const PaintedView& view : painted) masks[view.name] = view.mask;
  masks.erase("free view 1");
  const auto pictures = PicturesOfPaint(session->scene(), painted, masks);
  ASSERT_EQ(pictures.size(), 2u);
  EXPECT_EQ(pictures[0].view, world.view(3).name);
  EXPECT_EQ(pictures[1].view, world.view(1).name);
  EXPECT_EQ(pictures[0].counts.kept, CountInside(painted[0].mask));
  EXPECT_EQ(pictures[0].picture.width, painted[0].mask.width);
}

}  // namespace
}  // namespace retint
