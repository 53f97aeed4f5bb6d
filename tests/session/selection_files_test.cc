// SPDX-License-Identifier: BSD-3-Clause
#include "session/selection_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "base/files.h"
#include "colmap_io/image_io.h"
#include "tests/support/data.h"

namespace retint {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::ThrowsMessage;

class SelectionFilesTest : public testing::Test {
 protected:
  SelectionFilesTest() {
    masks_["a.png"](1, 2) = 255;
    masks_["sub/b.png"](0, 0) = 77;
    WriteShares(folder_.path(), masks_, shares_);
  }

  TempFolder folder_;
  std::map<std::string, Mask> masks_ = {{"a.png", Mask(4, 3)}, {"sub/b.png", Mask(5, 2)}};
  const std::vector<float> shares_ = {0, 0.1F, 1, 1.0F / 3};
};

TEST_F(SelectionFilesTest, MasksComeBack) {
  Monitor monitor;
  WriteMasks(folder_.path(), masks_, monitor);
  for (const auto& [name, mask] : masks_) {
    EXPECT_EQ(ReadMask(ViewFile(folder_.path(), name)).data, mask.data) << name;
  }
}

TEST_F(SelectionFilesTest, SharesComeBackToTheBit) {
  const SharesOfMasks read = ReadShares(folder_.path(), masks_, 4);
  EXPECT_EQ(read.shares, shares_);
  EXPECT_THAT(read.why_not, IsEmpty());
}

TEST_F(SelectionFilesTest, ConfidenceComesBackWithItsShares) {
  EXPECT_THAT(ReadShares(folder_.path(), masks_, 4).confidence, IsEmpty());
  const std::vector<float> confidence = {1, 0.75F, 0, 0.5F};
  WriteShares(folder_.path(), masks_, shares_, confidence);
  EXPECT_EQ(ReadShares(folder_.path(), masks_, 4).confidence, confidence);
  // Shares of other masks, written without: what lies there from before is not theirs.
  auto others = masks_;
  others["a.png"](0, 0) = 1;
  WriteShares(folder_.path(), others, shares_);
  const SharesOfMasks read = ReadShares(folder_.path(), others, 4);
  EXPECT_EQ(read.shares, shares_);
  EXPECT_THAT(read.confidence, IsEmpty());
  WriteFile(folder_ / "confidence.bin", "RTCONFID");
  EXPECT_THAT([&] { ReadShares(folder_.path(), others, 4); },
              ThrowsMessage<InputError>(HasSubstr("confidence.bin")));
}

TEST_F(SelectionFilesTest, AFolderWithoutSharesIsNoFault) {
  TempFolder empty;
  const SharesOfMasks read = ReadShares(empty.path(), masks_, 4);
  EXPECT_THAT(read.shares, IsEmpty());
  EXPECT_THAT(read.why_not, IsEmpty());
}

TEST_F(SelectionFilesTest, SharesOfOtherMasksAreLeftAside) {
  auto painted = masks_;
  painted["a.png"](0, 0) = 1;
  auto fewer = masks_;
  fewer.erase("a.png");
  auto renamed = masks_;
  renamed.erase("a.png");
  renamed["c.png"] = masks_["a.png"];
  for (const auto& other : {painted, fewer, renamed}) {
    const SharesOfMasks read = ReadShares(folder_.path(), other, 4);
    EXPECT_THAT(read.shares, IsEmpty());
    EXPECT_THAT(read.why_not, HasSubstr("other masks"));
  }
}

TEST_F(SelectionFilesTest, SharesOfAnotherSplatAreLeftAside) {
  const SharesOfMasks read = ReadShares(folder_.path(), masks_, 5);
  EXPECT_THAT(read.shares, IsEmpty());
  EXPECT_THAT(read.why_not, HasSubstr("4 Gaussians and the splat has 5"));
}

TEST_F(SelectionFilesTest, DamageIsNamed) {
  const auto path = folder_ / "shares.bin";
  const std::string whole = ReadFile(path);
  const auto read = [&] { ReadShares(folder_.path(), masks_, 4); };
  for (size_t size = 0; size < whole.size(); ++size) {
    WriteFile(path, std::string_view(whole).substr(0, size));
    EXPECT_THAT(read, ThrowsMessage<InputError>(HasSubstr("shares.bin"))) << size << " bytes";
  }
  WriteFile(path, whole + "more");
  EXPECT_THAT(read, ThrowsMessage<InputError>(HasSubstr("bytes of shares")));
  WriteFile(path, "RTSHAREZ" + whole.substr(8));
  EXPECT_THAT(read, ThrowsMessage<InputError>(HasSubstr("not a file of shares")));
  WriteShares(folder_.path(), masks_, {0, 0.5F, 1.5F, 0});
  EXPECT_THAT(read, ThrowsMessage<InputError>(HasSubstr("share of Gaussian 2")));
}

}  // namespace
}  // namespace retint
