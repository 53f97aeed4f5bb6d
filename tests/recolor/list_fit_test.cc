// SPDX-License-Identifier: BSD-3-Clause
// Fits of edits that are no affine map, by both solvers and to both kinds of targets.
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "recolor/edit_text.h"
#include "recolor/quality_report.h"
#include "recolor/sh_refitter.h"
#include "tests/recolor/tiny_scene.h"

namespace retint {
namespace {

ColorOperation Parse(const char* name, const char* text) {
  return ParseOperation(*FindOperationType(name), text);
}

ColorOperation GammaTable() {
  auto table = std::make_shared<ColorTable>();
  table->size = 9;
  for (int i = 0; i < 9 * 9 * 9; ++i) {
    for (const int at : {i % 9, i / 9 % 9, i / 81}) {
      table->values.push_back(std::sqrt(float(at) / 8));
    }
  }
  return ColorOperation::Lut(table);
}

std::vector<ColorOperation> Operations() {
  return {Parse("exposure", "0.7"),
          Parse("gamma", "1.5"),
          Parse("white_balance", "40,10"),
          Parse("gray", ""),
          Parse("adjust", "hue=60,chroma=1.2,lightness=0.9"),
          Parse("recolor", "#3060ff,from=0.6:0.5:0.3,brightest=1.5"),
          Parse("gradient", "#200000,#3060ff,#ffffff"),
          GammaTable()};
}

QualityNumbers Fit(TinyScene& scene, const ColorEdit& edit, const RefitOptions& options) {
  Renderer renderer = scene.MakeRenderer();
  Monitor monitor;
  ShRefitter refitter(renderer, scene.model, scene.Targets(), edit, scene.shares, options, monitor);
  refitter.Run(monitor);
  const FloatArray sh = refitter.Sh();
  return EvaluateEdit(renderer, scene.model.sh, sh, scene.Targets(), {}, edit, monitor).train;
}

// A scene whose colors lie well within the range, and change gently with the direction.
TinyScene GentleScene(uint64_t seed) {
  TinyScene scene(seed);
  for (float& value : scene.model.sh) value *= 0.6f;
  return scene;
}

TEST(ListFitTest, EveryOperationIsFitted) {
  for (const ColorOperation& operation : Operations()) {
    TinyScene scene = GentleScene(61);
    const ColorEdit edit{{operation}, 1};
    const QualityNumbers numbers = Fit(scene, edit, RefitOptions());
    const std::string name = TypeOf(operation.kind).name;
    // Small Gaussians of random colors overlap in every pixel, so an edit of a blend is not a blend
    // of edits. The fit removes most of the error, not all.
    EXPECT_GT(numbers.psnr_inside_after, numbers.psnr_inside_before + 6) << name;
    EXPECT_GT(numbers.psnr_inside_after, 26) << name;
  }
}

TEST(ListFitTest, AdamAndPhotosTakeListsToo) {
  ColorEdit edit{{Parse("exposure", "0.5"), Parse("adjust", "hue=60")}, 0.8f};
  TinyScene scene = GentleScene(62);
  RefitOptions adam;
  adam.solver = Solver::kAdam;
  adam.adam.iterations = 60;
  const QualityNumbers by_adam = Fit(scene, edit, adam);
  EXPECT_GT(by_adam.psnr_inside_after, by_adam.psnr_inside_before + 6);
  Renderer renderer = scene.MakeRenderer();
  for (const PosedCamera& camera : scene.cameras) {
    scene.photos.push_back(renderer.Render(camera).rgb);
  }
  const QualityNumbers of_photos = Fit(scene, edit, RefitOptions());
  EXPECT_GT(of_photos.psnr_inside_after, of_photos.psnr_inside_before + 6);
}

TEST(ListFitTest, AListOfNothingChangesNoBit) {
  TinyScene scene = GentleScene(63);
  Renderer renderer = scene.MakeRenderer();
  Monitor monitor;
  const ColorEdit edit{{Parse("gamma", "2")}, 0};
  ShRefitter refitter(renderer, scene.model, scene.Targets(), edit, scene.shares, RefitOptions(),
                      monitor);
  refitter.Run(monitor);
  EXPECT_EQ(refitter.Sh(), scene.model.sh);
}

TEST(ListFitTest, TellsWhatNoScreenShows) {
  TinyScene scene = GentleScene(64);
  ColorEdit edit{{Parse("exposure", "3")}, 1};
  EXPECT_GT(Fit(scene, edit, RefitOptions()).out_of_gamut, 0.3);
  edit.operations.push_back(Parse("soft_clip", ""));
  EXPECT_GT(Fit(scene, edit, RefitOptions()).out_of_gamut, 0.3);  // before soft clipping
  edit.operations = {Parse("exposure", "-2")};
  EXPECT_EQ(Fit(scene, edit, RefitOptions()).out_of_gamut, 0);
  // Recoloring leaves no color out of range.
  for (const char* to : {"#ffffff,from=0.3:0.3:0.3,brightest=3", "#303030,from=0.6:0.6:0.6"}) {
    edit.operations = {Parse("recolor", to)};
    EXPECT_EQ(Fit(scene, edit, RefitOptions()).out_of_gamut, 0) << to;
  }
}

}  // namespace
}  // namespace retint
