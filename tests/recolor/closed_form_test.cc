// SPDX-License-Identifier: BSD-3-Clause
#include <cstring>
#include <span>

#include <gtest/gtest.h>

#include "base/error.h"
#include "tests/recolor/tiny_scene.h"
#include "tests/support/closed_form.h"

namespace retint {
namespace {

// One Gaussian, positive from every side, so that no colour is clamped.
GaussianModel IsolatedGaussian() {
  GaussianModel model;
  model.Resize(1, 3);
  SetGaussian(model, 0, {0, 0, 0}, 0.4, 6);
  TestRandom random(7);
  for (size_t i = 0; i < model.sh.size(); ++i) {
    model.sh[i] = float(i < 3 ? random.Uniform(0.2, 1.2) : random.Uniform(-0.05, 0.05));
  }
  return model;
}

FloatArray Preview(const GaussianModel& model, const std::vector<float>& shares,
                   const ColorEdit& edit) {
  const auto backend = CreateBackend("cpu");
  return ClosedFormSh(*backend, model.sh, model.NumShCoeffs(), shares, edit);
}

ColorEdit MixingEdit() {
  AffineColor map;
  map.gain << 0.2f, 0.3f, 0.1f, 0.0f, 0.7f, 0.2f, 0.4f, 0.0f, 1.1f;
  return ColorEdit::FromAffine(map);
}

Image RenderSh(const GaussianModel& model, std::span<const float> sh, const PosedCamera& view) {
  Renderer renderer(CreateBackend("cpu"), model);
  renderer.SetSh(sh);
  return renderer.Render(view).rgb;
}

TEST(ClosedFormTest, ChangesGaussiansOfMoreThanFivePercent) {
  const GaussianModel model = IsolatedGaussian();
  const ColorEdit edit = ColorEdit::Tint({0.3f, 1.0f, 1.6f});
  EXPECT_EQ(Preview(model, {0.049f}, edit), model.sh);
  EXPECT_NE(Preview(model, {0.051f}, edit), model.sh);
}

TEST(ClosedFormTest, IsExactForAnIsolatedGaussian) {
  const GaussianModel model = IsolatedGaussian();
  for (const ColorEdit& edit : {ColorEdit::Tint({0.3f, 1.0f, 1.6f}), MixingEdit()}) {
    for (const float share : {0.4f, 1.0f}) {
      const auto sh = Preview(model, std::vector<float>{share}, edit);
      for (const double azimuth : {-0.8, 0.0, 0.5}) {
        const PosedCamera view = LookAtOrigin(azimuth, 3);
        const Image before = RenderSh(model, model.sh, view);
        const Image after = RenderSh(model, sh, view);
        float brightest = 0;
        for (size_t p = 0; p < before.NumPixels(); ++p) {
          const Eigen::Map<const Eigen::Vector3f> old(&before.data[3 * p]);
          const Eigen::Vector3f wanted = CompiledEdit(edit).Apply(old, share);
          for (int c = 0; c < 3; ++c) {
            // Sums of 16 terms below 1 in single precision, and the SIMD exponential's 1e-6.
            ASSERT_NEAR(after.data[3 * p + size_t(c)], wanted[c], 4e-6f);
            brightest = std::max(brightest, old[c]);
          }
        }
        EXPECT_GT(brightest, 0.3f);  // the Gaussian is in the picture
      }
    }
  }
}

ColorEdit GradingEdit() {
  ColorEdit edit;
  edit.operations = {ColorOperation::Make(ColorOperationKind::kExposure, {0.5f}),
                     ColorOperation::Make(ColorOperationKind::kAdjust, {40, 1.2f})};
  return edit;
}

TEST(ClosedFormTest, AppliesAnyEditToColorsInAllDirections) {
  GaussianModel model = IsolatedGaussian();
  const CompiledEdit edit(GradingEdit());
  for (const bool view_dependent : {false, true}) {
    if (!view_dependent) std::fill(model.sh.begin() + 3, model.sh.end(), 0.0f);
    const auto sh = Preview(model, std::vector<float>{0.8f}, GradingEdit());
    for (const double azimuth : {-0.8, 0.0, 0.5}) {
      const PosedCamera view = LookAtOrigin(azimuth, 3);
      const Image before = RenderSh(model, model.sh, view);
      const Image after = RenderSh(model, sh, view);
      const size_t middle = 3 * (24 * 64 + 32);
      const Eigen::Map<const Eigen::Vector3f> old(&before.data[middle]);
      // Opaque except for 1 / (1 + e^6); the edit is of the color itself.
      const float alpha = 1 / (1 + std::exp(-6.0f));
      const Eigen::Vector3f color = old / alpha;
      const Eigen::Vector3f wanted = alpha * edit.Apply(color, 0.8f);
      for (int c = 0; c < 3; ++c) {
        // A uniform color is exact up to rounding. If a color varies by a few percent over the
        // sphere, harmonics of degree 3 miss the third order and above.
        EXPECT_NEAR(after.data[middle + size_t(c)], wanted[c], view_dependent ? 0.02f : 5e-4f);
        EXPECT_GT(std::abs(wanted[c] - old[c]), 0.0f);
      }
    }
    model = IsolatedGaussian();
  }
}

TEST(ClosedFormTest, OffsetMovesTheColour) {
  const GaussianModel model = IsolatedGaussian();
  AffineColor map;
  map.gain.setZero();
  map.offset = {0.25f, 0.5f, 0.75f};
  const auto sh = Preview(model, std::vector<float>{1.0f}, ColorEdit::FromAffine(map));
  // The colour is 0.5 + Y_00 C_0 exactly where the higher bands vanish.
  for (size_t c = 0; c < 3; ++c) {
    EXPECT_NEAR(0.5f + 0.28209479f * sh[c], map.offset[Eigen::Index(c)], 1e-6f);
  }
  for (size_t i = 3; i < sh.size(); ++i) EXPECT_EQ(sh[i], 0.0f);
}

TEST(ClosedFormTest, IdentityAndSmallSharesChangeNoBit) {
  TinyScene scene(3);
  scene.model.sh[5] = -0.0f;
  const auto same = Preview(scene.model, scene.shares, ColorEdit::Tint({1, 1, 1}));
  EXPECT_EQ(std::memcmp(same.data(), scene.model.sh.data(), same.size() * sizeof(float)), 0);
  const std::vector<float> small(scene.shares.size(), 0.99e-3f);
  const auto untouched = Preview(scene.model, small, ColorEdit::Tint({0, 1, 1}));
  EXPECT_EQ(std::memcmp(untouched.data(), scene.model.sh.data(), same.size() * sizeof(float)), 0);
}

TEST(ClosedFormTest, RefusesSharesOfAnotherModel) {
  const GaussianModel model = IsolatedGaussian();
  EXPECT_THROW(Preview(model, std::vector<float>(2, 1.0f), ColorEdit()), OptionError);
}

TEST(MaskSharesTest, FollowTheMasks) {
  TinyScene scene(11);
  Renderer renderer = scene.MakeRenderer();
  Monitor monitor;
  scene.FillMasks(0);
  for (const float share : MaskShares(renderer, scene.Targets(), monitor)) EXPECT_EQ(share, 0.0f);
  scene.FillMasks(255);
  std::vector<int> visible(scene.shares.size(), 0);
  for (const auto& camera : scene.cameras) {
    const std::vector<float> ones(64 * 48, 1.0f);
    const auto weights = BlendTransposeToGaussians(renderer, camera, ones);
    for (size_t g = 0; g < weights.size(); ++g) visible[g] += weights[g] > 0;
  }
  const auto shares = MaskShares(renderer, scene.Targets(), monitor);
  for (size_t g = 0; g < shares.size(); ++g) {
    EXPECT_NEAR(shares[g], visible[g] > 0 ? 1.0f : 0.0f, 1e-6f);  // the same sum, divided by itself
  }
}

// Against the formula, with the weights read off by blending one Gaussian at a time.
TEST(MaskSharesTest, MatchTheDefinition) {
  TinyScene scene(12, 40, 3);
  Renderer renderer = scene.MakeRenderer();
  Monitor monitor;
  const auto shares = MaskShares(renderer, scene.Targets(), monitor);
  for (size_t g = 0; g < 40; g += 7) {
    std::vector<float> one(40, 0.0f);
    one[g] = 1;
    double inside = 0, total = 0;
    for (size_t v = 0; v < scene.cameras.size(); ++v) {
      const auto weights = BlendFeatures(renderer, scene.cameras[v], one);
      for (size_t p = 0; p < weights.size(); ++p) {
        inside += double(weights[p]) * scene.masks[v].data[p] / 255;
        total += double(weights[p]);
      }
    }
    // Thousands of single-precision terms, summed in another order.
    EXPECT_NEAR(shares[g], total > 0 ? inside / total : 0, 2e-5) << g;
  }
}

}  // namespace
}  // namespace retint
