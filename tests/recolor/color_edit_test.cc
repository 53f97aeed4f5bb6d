// SPDX-License-Identifier: BSD-3-Clause
#include "recolor/color_edit.h"

#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"

namespace retint {
namespace {

using testing::HasSubstr;
using testing::Property;
using testing::ThrowsMessage;

TEST(ColorEditTest, TintFiltersByTheMask) {
  const ColorEdit edit = ColorEdit::Tint({0.5f, 1.0f, 2.0f});
  const Eigen::Vector3f color(0.8f, 0.4f, 0.2f);
  EXPECT_EQ(edit.Apply(color, 0), color);
  // One multiplication and two additions: within two units in the last place.
  EXPECT_TRUE(edit.Apply(color, 1).isApprox(Eigen::Vector3f(0.4f, 0.4f, 0.4f), 3e-7f));
  EXPECT_TRUE(edit.Apply(color, 0.5f).isApprox(Eigen::Vector3f(0.6f, 0.4f, 0.3f), 3e-7f));
}

TEST(ColorEditTest, StrengthInterpolatesFromIdentity) {
  ColorEdit edit = ColorEdit::Tint({0, 1, 3});
  edit.gain(0, 2) = 0.5f;
  edit.offset = {0.25f, 0, 0};
  const ColorEdit none = edit.WithStrength(0);
  EXPECT_EQ(none.gain, Eigen::Matrix3f(Eigen::Matrix3f::Identity()));
  EXPECT_EQ(none.offset, Eigen::Vector3f(0, 0, 0));
  EXPECT_EQ(edit.WithStrength(1).gain, edit.gain);
  const ColorEdit half = edit.WithStrength(0.5f);
  EXPECT_EQ(half.gain.diagonal(), Eigen::Vector3f(0.5f, 1, 2));
  EXPECT_EQ(half.gain(0, 2), 0.25f);
  EXPECT_EQ(half.offset[0], 0.125f);
}

TEST(ColorEditTest, CheckRefusesWhatIsNoEdit) {
  EXPECT_NO_THROW(ColorEdit().Check());
  EXPECT_THROW(ColorEdit::Tint({-0.1f, 1, 1}).Check(), OptionError);
  EXPECT_THROW(ColorEdit::Tint({std::numeric_limits<float>::quiet_NaN(), 1, 1}).Check(),
               OptionError);
  ColorEdit edit;
  edit.offset[1] = std::numeric_limits<float>::infinity();
  EXPECT_THROW(edit.Check(), OptionError);
}

TEST(ParseTintTest, ReadsNumbersAndHex) {
  EXPECT_EQ(ParseTint("1,0.5,0").gain.diagonal(), Eigen::Vector3f(1, 0.5f, 0));
  EXPECT_EQ(ParseTint(" 2 , 1e-1 ,.25 ").gain.diagonal(), Eigen::Vector3f(2, 0.1f, 0.25f));
  EXPECT_EQ(ParseTint("#3060ff").gain.diagonal(), Eigen::Vector3f(48.0f / 255, 96.0f / 255, 1.0f));
  EXPECT_EQ(ParseTint("#FFffFF").gain, Eigen::Matrix3f(Eigen::Matrix3f::Identity()));
  EXPECT_EQ(ParseTint("1,1,1").offset, Eigen::Vector3f(0, 0, 0));
}

TEST(ParseTintTest, RefusesTheRestByName) {
  for (const char* bad :
       {"", "  ", "1", "1,2", "1,2,3,4", "1,2,", ",,", "a,b,c", "1,2,3x", "1;2;3", "-1,0,0",
        "nan,1,1", "inf,1,1", "1e99,1,1", "#", "#12345", "#1234567", "#12345g", "3060ff"}) {
    EXPECT_THAT([&] { ParseTint(bad); }, ThrowsMessage<OptionError>(HasSubstr("tint '"))) << bad;
  }
}

}  // namespace
}  // namespace retint
