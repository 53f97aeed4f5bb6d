// SPDX-License-Identifier: BSD-3-Clause
#include "selecting/selection_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "base/files.h"
#include "colmap_io/image_io.h"
#include "splat_io/splat_io.h"
#include "tests/splat_io/random_scene.h"
#include "tests/support/data.h"

namespace retint {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::ThrowsMessage;

// Views of the masks' names and sizes.
Workspace WorkspaceOf(const std::map<std::string, Mask>& masks) {
  Workspace workspace;
  Reconstruction& model = workspace.reconstruction;
  for (const auto& [name, mask] : masks) {
    const auto id = static_cast<uint32_t>(model.views.size() + 1);
    model.cameras[id] = Camera::Pinhole(id, mask.width, mask.height, 10, 10, 2, 2);
    model.views[id].id = model.views[id].camera_id = id;
    model.views[id].name = name;
  }
  return workspace;
}

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
  // Other masks, written without shares: old shares there are not theirs.
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

// Of a splat larger than memory: the shares of a part are written, and read, as those of all.
TEST_F(SelectionFilesTest, SharesOfAPartAreThoseOfTheWhole) {
  WriteSplat(folder_ / "splat.ply", RandomScene(7, 0, 1));
  ScenePart part;
  part.file = std::make_shared<const PlyFile>(folder_ / "splat.ply");
  part.records = {1, 2, 4, 6};
  WriteShares(folder_.path(), masks_, shares_, {0.5F, 0, 0.25F, 0}, &part);
  const SharesOfMasks read = ReadShares(folder_.path(), masks_, 7);
  EXPECT_EQ(read.shares,
            (std::vector<float>{0, shares_[0], shares_[1], 0, shares_[2], 0, shares_[3]}));
  EXPECT_EQ(read.confidence, (std::vector<float>{1, 0.5F, 0, 1, 0.25F, 1, 0}));

  Monitor monitor;
  WriteMasks(folder_.path(), masks_, monitor);
  const Workspace workspace = WorkspaceOf(masks_);
  const Pictures pictures(workspace, Pixels::kPhoto);
  const MaskFolder folder = ReadMaskFolder(folder_.path(), /*invert=*/false, pictures);
  const SparseShares sparse = ReadSparseShares(folder_.path(), folder.checksum, 7);
  EXPECT_TRUE(sparse.known);
  EXPECT_EQ(sparse.gaussians, (std::vector<uint32_t>{2, 4, 6}));
  EXPECT_EQ(sparse.Of(part.records), shares_);
  EXPECT_EQ(sparse.Of(std::vector<uint32_t>{0, 4, 5}), (std::vector<float>{0, 1, 0}));
  EXPECT_EQ(sparse.Above(0.2), (std::vector<uint32_t>{4, 6}));
  EXPECT_THAT(ReadSparseShares(folder_.path(), folder.checksum, 8).why_not,
              HasSubstr("7 Gaussians and the splat has 8"));
}

TEST_F(SelectionFilesTest, AFolderOfMasksHoldsThoseThatSelectSomething) {
  Monitor monitor;
  masks_["c.png"] = Mask(3, 3);
  WriteMasks(folder_.path(), masks_, monitor);
  auto views_masks = masks_;
  views_masks["none.png"] = Mask(3, 3);
  const Workspace workspace = WorkspaceOf(views_masks);
  std::vector<const View*> views = workspace.reconstruction.ViewsByName();
  const Pictures pictures(workspace, Pixels::kPhoto);
  MaskFolder folder = ReadMaskFolder(folder_.path(), /*invert=*/false, pictures);
  EXPECT_EQ(folder.masks.size(), 2U);
  EXPECT_THAT(folder.empty, testing::ElementsAre("c.png"));
  views.pop_back();
  const auto of_views = std::move(folder).OfViews(pictures, views);
  EXPECT_EQ(of_views.size(), 2U);
  EXPECT_EQ(of_views.at("a.png").data, masks_["a.png"].data);
  EXPECT_EQ(of_views.at("c.png").data, masks_["c.png"].data);
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
