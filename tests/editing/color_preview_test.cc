// SPDX-License-Identifier: BSD-3-Clause
#include "editing/color_preview.h"

#include <algorithm>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "editing/refit_chain.h"
#include "tests/editing/session_scene.h"

namespace retint {
namespace {

// Two regions of a scene; the second is the rest of the first.
class ColorPreviewTest : public testing::Test {
 protected:
  ColorPreviewTest() {
    regions_.regions.resize(2);
    for (size_t i = 0; i < 2; ++i) {
      auto selection = std::make_shared<RegionSelection>();
      for (const float share : scene_.shares)
        selection->shares.push_back(i == 0 ? share : 1 - share);
      // Some that no region touches.
      for (size_t g = 0; g < selection->shares.size(); g += 5) selection->shares[g] = 0;
      regions_.regions[i].id = RegionId(i + 1);
      regions_.regions[i].selection = selection;
      regions_.regions[i].edit = ColorEdit::Tint({0.2f, 0.4f, 1});
    }
  }
  void Grade(size_t region, float stops) {
    regions_.regions[region].edit.operations = {
        ColorOperation::Make(ColorOperationKind::kExposure, {stops})};
  }
  FloatArray Expected() {
    return ComposeSh(*backend_, regions_, {}, 0, regions_.regions.size(), scene_.model.sh,
                     scene_.model);
  }
  ColorPreview MakePreview() {
    return {std::make_shared<const GaussianModel>(scene_.model), backend_};
  }

  const TinyScene scene_{5};
  const std::shared_ptr<Backend> backend_ = CreateBackend("cpu");
  RegionSet regions_;
};

TEST_F(ColorPreviewTest, IsTheWholeSceneWithItsRegions) {
  ColorPreview preview = MakePreview();
  EXPECT_EQ(*preview.Compose(regions_, {}).sh, Expected());
  Grade(0, 0.5f);
  EXPECT_EQ(*preview.Compose(regions_, {}).sh, Expected());
  regions_.regions[1].visible = false;
  EXPECT_EQ(*preview.Compose(regions_, {}).sh, Expected());
  EXPECT_NE(Expected(), scene_.model.sh);
}

TEST_F(ColorPreviewTest, AnEditOfOneRegionDoesNotMoveAnother) {
  const size_t block = size_t(scene_.model.NumShCoeffs()) * 3, count = scene_.model.NumGaussians();
  for (size_t i = 0; i < 2; ++i) {
    auto selection = std::make_shared<RegionSelection>();
    for (size_t g = 0; g < count; ++g) selection->shares.push_back(g % 3 == i ? 1.0f : 0.0f);
    if (i == 1) selection->shares[0] = 1;  // both touch it
    regions_.regions[i].selection = selection;
  }
  auto fit = std::make_shared<RegionFit>();
  fit->key = regions_.FitKey(1, {});
  fit->indices = {0, 1, 4};
  fit->sh.assign(3 * block, 0.25f);
  regions_.regions[1].fit = fit;
  const FloatArray fitted = Expected();
  Grade(0, 0.5f);
  const FloatArray graded = Expected();
  for (const size_t g : {size_t{1}, size_t{4}}) {
    for (size_t i = 0; i < block; ++i) EXPECT_EQ(graded[g * block + i], 0.25f);
  }
  EXPECT_EQ(fitted[0], 0.25f);
  EXPECT_NE(graded[0], 0.25f) << "what both touch follows the edit";
  Grade(1, 0.5f);
  EXPECT_NE(Expected()[block], 0.25f) << "its own edit is another";
  EXPECT_EQ(*MakePreview().Compose(regions_, {}).sh, Expected());
}

TEST_F(ColorPreviewTest, NamesWhatMayDiffer) {
  ColorPreview preview = MakePreview();
  const ColorPreview::Colors colors = preview.Compose(regions_, {});
  const size_t block = size_t(scene_.model.NumShCoeffs()) * 3;
  ASSERT_LT(colors.active->size(), scene_.shares.size());
  for (size_t g = 0; g < scene_.shares.size(); ++g) {
    if (std::binary_search(colors.active->begin(), colors.active->end(), int32_t(g))) continue;
    EXPECT_TRUE(std::equal(&(*colors.sh)[g * block], &(*colors.sh)[g * block] + block,
                           &scene_.model.sh[g * block]))
        << g;
  }
}

// An array that comes back holds the colors of other Gaussians, which must be put right.
TEST_F(ColorPreviewTest, UsesArraysAgainForOtherSelections) {
  ColorPreview preview = MakePreview();
  EXPECT_TRUE(preview.MakeReady());
  const RegionSet both = regions_;
  const float* first = preview.Compose(regions_, {}).sh->data();
  regions_.regions.pop_back();
  while (preview.MakeReady()) {
  }
  bool again = false;
  std::vector<ColorPreview::Colors> held;
  for (int i = 0; i < 4; ++i) {
    held.push_back(preview.Compose(regions_, {}));
    EXPECT_EQ(*held.back().sh, Expected());
    again = again || held.back().sh->data() == first;
  }
  EXPECT_TRUE(again);
  held.clear();
  regions_ = both;
  EXPECT_EQ(*preview.Compose(regions_, {}).sh, Expected());
}

// Pointers to earlier colors keep them while new ones are made.
TEST_F(ColorPreviewTest, LeavesWhatIsHeldAlone) {
  ColorPreview preview = MakePreview();
  const ColorPreview::Colors held = preview.Compose(regions_, {});
  const FloatArray copy = *held.sh;
  for (const float stops : {0.5f, 1.0f, -1.0f}) {
    Grade(0, stops);
    preview.Compose(regions_, {});
  }
  EXPECT_EQ(*held.sh, copy);
}

}  // namespace
}  // namespace retint
