// SPDX-License-Identifier: BSD-3-Clause
// Splats whose blended colors are light: renders and edits are of the display's encoding all the
// same, and fits stay in the splat's own space.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "kernels/common/color_spaces.h"
#include "kernels/common/sh.h"
#include "recolor/quality_report.h"
#include "tests/recolor/tiny_scene.h"
#include "tests/support/closed_form.h"

namespace retint {
namespace {

ColorEdit Exposure(float stops) {
  return {{ColorOperation::Make(ColorOperationKind::kExposure, {stops})}, 1};
}

class LinearSpace : public testing::Test {
 protected:
  LinearSpace() { scene_.model.traits.color_space = ColorSpace::kLinearDisplay; }

  TinyScene scene_{71};
  Monitor monitor_;
};

TEST_F(LinearSpace, ARenderIsTheEncodingOfTheBlend) {
  RendererOptions options;
  options.background = {0.2f, 0.5f, 0.9f};
  Renderer encoded = scene_.MakeRenderer(options);
  EXPECT_TRUE(encoded.light_map());
  scene_.model.traits.color_space = ColorSpace::kSrgbDisplay;
  for (float& channel : options.background) channel = LinearFromSrgb(channel);
  Renderer light = scene_.MakeRenderer(options);
  const Image image = encoded.Render(scene_.cameras[0]).rgb;
  const Image blend = light.Render(scene_.cameras[0]).rgb;
  for (size_t i = 0; i < image.data.size(); ++i) {
    ASSERT_NEAR(image.data[i], SrgbFromLinear(blend.data[i]), 2e-6) << i;  // powers of SIMD
  }
}

// An exposure is a factor of light: of linear coefficients it is one, exactly, whereas it is none
// of encoded ones.
TEST_F(LinearSpace, AnExposureScalesCoefficients) {
  GaussianModel& model = scene_.model;
  for (float& value : model.sh) value *= 0.2f;  // colors about 0.5, none below 0
  const ColorEdit edit = Exposure(-1).OnColorsOf(model);
  EXPECT_FALSE(edit.IsAffine());
  const std::vector<float> ones(model.NumGaussians(), 1.0f);
  const FloatArray after = ClosedFormSh(*scene_.backend, model.sh, model.NumShCoeffs(), ones, edit);
  const size_t block = size_t(model.NumShCoeffs()) * 3;
  for (size_t i = 0; i < after.size(); ++i) {
    const bool is_dc = i % block < 3;
    const float expected =
        is_dc ? ((0.5f + kShC0 * model.sh[i]) / 2 - 0.5f) / kShC0 : model.sh[i] / 2;
    ASSERT_NEAR(after[i], expected, 1e-4) << i;  // powers there and back, and a fit of 36 colors
  }
}

class LinearFit : public LinearSpace, public testing::WithParamInterface<Solver> {};

TEST_P(LinearFit, AFitReachesTheEditedEncodings) {
  const ColorEdit edit = ColorEdit::Tint({0.4f, 0.8f, 1.1f});
  RefitOptions options;
  options.solver = GetParam();
  options.adam.iterations = 300;
  // Of a renderer and a fit that take the coefficients for light or not.
  const auto psnr_after = [&](ColorSpace rendered, ColorSpace fitted) {
    scene_.model.traits.color_space = rendered;
    Renderer renderer = scene_.MakeRenderer();
    scene_.model.traits.color_space = fitted;
    ShRefitter refitter(renderer, scene_.model, scene_.Targets(), edit, scene_.shares, options,
                        monitor_);
    refitter.Run(monitor_);
    return EvaluateEdit(renderer, scene_.model.sh, refitter.Sh(), scene_.Targets(), {}, edit,
                        monitor_)
        .train.psnr_inside_after;
  };
  const auto linear = ColorSpace::kLinearDisplay;
  const double right = psnr_after(linear, linear);
  EXPECT_GT(right, 32);  // the encoding makes errors of dark colors up to 13 times as large
  EXPECT_GT(right, psnr_after(linear, ColorSpace::kSrgbDisplay) + 10);
}

INSTANTIATE_TEST_SUITE_P(Solvers, LinearFit, testing::Values(Solver::kMm, Solver::kAdam),
                         [](auto& param) { return param.param == Solver::kMm ? "mm" : "adam"; });

}  // namespace
}  // namespace retint
