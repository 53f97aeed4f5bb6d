// SPDX-License-Identifier: BSD-3-Clause
#include "scene/image.h"

#include <vector>

#include <gtest/gtest.h>

namespace retint {
namespace {

TEST(PixelArrayTest, RowMajorChannelsLast) {
  Image image(4, 3, 0.5f);
  EXPECT_EQ(image.data.size(), 36u);
  EXPECT_EQ(image.NumPixels(), 12u);
  image(1, 2, 0) = 7;
  EXPECT_EQ(image.data[(2 * 4 + 1) * 3], 7);
  image(3, 2, 2) = 9;
  EXPECT_EQ(image.data.back(), 9);
  EXPECT_EQ(image(0, 0, 1), 0.5f);
}

TEST(PixelArrayTest, CopiesPixels) {
  const float pixels[] = {1, 2, 3, 4, 5, 6, 7};  // one more than are copied
  const Image image = Image::Of(1, 2, pixels);
  EXPECT_EQ(image.width, 1);
  EXPECT_EQ(image.height, 2);
  EXPECT_EQ(image.data, (std::vector<float>{1, 2, 3, 4, 5, 6}));
}

TEST(PixelArrayTest, ContainsItsOwnPixelsOnly) {
  const Mask mask(4, 3);
  EXPECT_TRUE(mask.Contains(0, 0));
  EXPECT_TRUE(mask.Contains(3, 2));
  EXPECT_FALSE(mask.Contains(4, 2));
  EXPECT_FALSE(mask.Contains(3, 3));
  EXPECT_FALSE(mask.Contains(-1, 0));
  EXPECT_FALSE(mask.Contains(0, -1));
}

TEST(PixelArrayTest, EmptyUntilSized) {
  EXPECT_TRUE(DepthMap().Empty());
  EXPECT_FALSE(DepthMap(1, 1).Empty());
}

}  // namespace
}  // namespace retint
