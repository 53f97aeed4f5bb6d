// SPDX-License-Identifier: BSD-3-Clause
#include "scene/contact_sheet.h"

#include <gtest/gtest.h>

#include "base/error.h"

namespace retint {
namespace {

TEST(ContactSheet, LaysOutRowsAndColumns) {
  const Image8 dark(40, 20, 10), light(40, 20, 200);
  const Image8 sheet = ContactSheet({{dark, light}, {light, dark}}, 20, 4);
  EXPECT_EQ(sheet.width, 2 * 20 + 3 * 4);
  EXPECT_EQ(sheet.height, 2 * 10 + 3 * 4);
  EXPECT_EQ(sheet(4, 4), 10);
  EXPECT_EQ(sheet(28, 4), 200);
  EXPECT_EQ(sheet(4, 18), 200);
  EXPECT_EQ(sheet(28, 18), 10);
  EXPECT_GT(sheet(1, 1), 230) << "the gap is light";
}

TEST(ContactSheet, ShrinkingAveragesAndKeepsTheMean) {
  Image8 stripes(64, 8);
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 64; ++x) stripes(x, y, 1) = x % 2 == 0 ? 0 : 255;
  }
  const Image8 sheet = ContactSheet({{stripes}}, 16, 0);
  // Each cell is exactly two dark and two light columns.
  for (int x = 0; x < 16; ++x) EXPECT_NEAR(sheet(x, 0, 1), 127.5, 0.6) << x;
}

TEST(ContactSheet, EnlargingKeepsAConstant) {
  const Image8 sheet = ContactSheet({{Image8(3, 3, 77)}}, 10, 0);
  EXPECT_EQ(sheet.width, 10);
  for (const uint8_t value : sheet.data) EXPECT_EQ(value, 77);
}

TEST(ContactSheet, RefusesNothingAndRaggedRows) {
  EXPECT_THROW(ContactSheet({}, 10), InputError);
  EXPECT_THROW(ContactSheet({{}}, 10), InputError);
  EXPECT_THROW(ContactSheet({{Image8()}}, 10), InputError);
  const Image8 one(2, 2);
  EXPECT_THROW(ContactSheet({{one}, {one, one}}, 10), InputError);
}

TEST(MaskOverlay, SetsTheSelectionApart) {
  Image grey(2, 1, 0.5F);
  Mask mask(2, 1);
  mask(1, 0) = 255;
  const Image8 overlay = MaskOverlay(grey, mask);
  EXPECT_EQ(overlay(0, 0, 0), overlay(0, 0, 2)) << "outside stays grey";
  EXPECT_LT(overlay(0, 0, 0), 100) << "and is darkened";
  EXPECT_GT(overlay(1, 0, 0), overlay(1, 0, 2) + 50) << "inside is coloured";
}

TEST(ToImage8, ClampsAndRounds) {
  Image image(2, 1);
  image.data = {-1, 0, 0.5F, 1, 2, 0.999F};
  EXPECT_EQ(ToImage8(image).data, (std::vector<uint8_t>{0, 0, 128, 255, 255, 255}));
}

}  // namespace
}  // namespace retint
