// SPDX-License-Identifier: BSD-3-Clause
#include "opening/align.h"

#include <gtest/gtest.h>

namespace retint {
namespace {

TEST(Align, APhotoThatIsNoWholeNumberOfPixelsKeepsItsScale) {
  const Camera camera = Camera::Pinhole(1, 107, 60, 96, 84, 54, 30);
  Image photo(camera.width, camera.height);
  for (int y = 0; y < photo.height; ++y) {
    for (int x = 0; x < photo.width; ++x) photo(x, y, 0) = float(x);
  }
  const ReducedPhoto reduced = Reduced(photo, camera, 12);
  EXPECT_EQ(reduced.photo.width, 8);
  EXPECT_EQ(reduced.photo.height, 5);
  EXPECT_FLOAT_EQ(reduced.photo(7, 4, 0), 7 * 12 + 5.5F) << "the mean of 84 to 95";
  EXPECT_EQ(reduced.camera.width, 8);
  EXPECT_EQ(reduced.camera.fx(), 8);
  EXPECT_EQ(reduced.camera.fy(), 7);
  EXPECT_EQ(reduced.camera.cx(), 4.5);
  EXPECT_EQ(reduced.camera.cy(), 2.5);
}

}  // namespace
}  // namespace retint
