// SPDX-License-Identifier: BSD-3-Clause
#include "scene/morton.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace retint {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

// The corners of a cube in the order of their bits: x counts least, z most.
TEST(MortonOrder, GoesThroughACubeCornerByCorner) {
  std::vector<float> corners;
  for (const int code : {6, 1, 7, 0, 4, 3, 2, 5}) {
    for (const int bit : {0, 1, 2}) corners.push_back(float(code >> bit & 1) * 8 - 3);
  }
  EXPECT_THAT(MortonOrder(corners), ElementsAre(3, 1, 6, 5, 4, 7, 0, 2));
}

TEST(MortonOrder, KeepsTheOrderOfPointsInOneCell) {
  EXPECT_THAT(MortonOrder({}), IsEmpty());
  const std::vector<float> same = {1, 2, 3, 1, 2, 3, 1, 2, 3};
  EXPECT_THAT(MortonOrder(same), ElementsAre(0, 1, 2));
  // A tenth of a cell apart, and then the other end.
  const std::vector<float> near = {1e-8f, 0, 0, 0, 0, 0, 1, 0, 0};
  EXPECT_THAT(MortonOrder(near), ElementsAre(0, 1, 2));
}

}  // namespace
}  // namespace retint
