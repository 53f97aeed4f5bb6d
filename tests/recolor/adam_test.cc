// SPDX-License-Identifier: BSD-3-Clause
#include "recolor/adam_solver.h"

#include <cstring>

#include <gtest/gtest.h>

#include "recolor/adam_boxes.h"
#include "tests/recolor/tiny_scene.h"

namespace retint {
namespace {

FloatArray FitSh(TinyScene& scene, const RefitOptions& options, RefitSummary* summary) {
  Renderer renderer = scene.MakeRenderer();
  Monitor monitor;
  ShRefitter refitter(renderer, scene.model, scene.Targets(), ColorEdit::Tint({0.3f, 0.8f, 1.2f}),
                      scene.shares, options, monitor);
  *summary = refitter.Run(monitor);
  return refitter.Sh();
}

// Directional derivatives of the whole loss, through the box targets, blending, SSIM and SH.
TEST(AdamTest, GradientMatchesCentralDifferences) {
  TinyScene scene(31);
  for (float& value : scene.model.sh) value *= 0.4f;  // away from the clamp, whose gradient is 0
  Renderer renderer = scene.MakeRenderer();
  Monitor monitor;
  RefitOptions options;
  options.solver = Solver::kAdam;
  for (const double lambda : {0.0, 0.2, 1.0}) {
    options.adam.lambda_dssim = lambda;
    AdamBoxes boxes;
    const ColorEdit edit = ColorEdit::Tint({0.3f, 0.8f, 1.2f});
    RefitViews views(renderer, {scene.model, scene.Targets(), edit, scene.shares}, options, boxes,
                     monitor);
    AdamSolver solver(views, options.adam);
    Backend& backend = views.backend();
    const size_t count = solver.coefficients().size();
    const auto values = backend.Download(solver.coefficients().data(), count);
    TestRandom random(17);
    for (size_t view = 0; view < views.NumViews(); view += 2) {
      solver.Evaluate(view);
      const auto gradient = backend.Download(solver.gradient().data(), count);
      // Along the gradient itself, so that the difference stands clear of rounding, and tilted.
      std::vector<float> direction(count);
      double norm = 0;
      for (const float g : gradient) norm += double(g) * g;
      norm = std::sqrt(norm / double(count));
      ASSERT_GT(norm, 0);
      for (size_t i = 0; i < count; ++i) {
        direction[i] = float(gradient[i] / norm * random.Uniform(0, 2));
      }
      double expected = 0;
      for (size_t i = 0; i < count; ++i) expected += double(gradient[i]) * direction[i];
      const float h = 1e-4f;
      double loss[2];
      for (const int side : {0, 1}) {
        std::vector<float> moved = values;
        for (size_t i = 0; i < count; ++i) moved[i] += (side ? h : -h) * direction[i];
        backend.CopyToDevice(solver.coefficients().data(), moved.data(), count * sizeof(float));
        const double before = solver.RecentLoss();
        solver.Evaluate(view);
        loss[side] = solver.RecentLoss() - before;
      }
      backend.CopyToDevice(solver.coefficients().data(), values.data(), count * sizeof(float));
      // The kinks of |y - y*| that a step crosses bend the difference by up to a few per cent.
      EXPECT_NEAR((loss[1] - loss[0]) / (2 * double(h)), expected, 0.05 * expected)
          << "lambda " << lambda << " view " << view;
    }
  }
}

TEST(AdamTest, LowersTheLossAndKeepsTheOthersBitForBit) {
  TinyScene scene(32);
  RefitOptions options;
  options.solver = Solver::kAdam;
  options.adam.closed_form_start = false;
  options.adam.learning_rate = 1e-2;
  options.adam.iterations = 300;
  RefitSummary summary;
  const auto sh = FitSh(scene, options, &summary);
  EXPECT_EQ(summary.solver, "adam");
  EXPECT_EQ(summary.iterations, 300);
  ASSERT_EQ(summary.losses.size(), 6u);  // a mean every 50 steps
  EXPECT_LT(summary.losses.back(), 0.5 * summary.losses.front());
  const size_t block = size_t(scene.model.NumShCoeffs()) * 3;
  for (size_t g = 0; g < scene.shares.size(); ++g) {
    if (scene.shares[g] > 0) continue;
    ASSERT_EQ(std::memcmp(&sh[g * block], &scene.model.sh[g * block], block * sizeof(float)), 0);
  }
}

// The paper's: from the coefficients as they are, and for as long as the caller wants.
TEST(AdamTest, WithoutALimitItGoesOnUntilTheCallerStops) {
  TinyScene scene(35);
  RefitOptions options;
  options.solver = Solver::kAdam;
  options.adam.iterations = 0;
  options.adam.closed_form_start = false;
  Renderer renderer = scene.MakeRenderer();
  std::vector<double> fractions;
  Monitor monitor([&](const Progress& progress) { fractions.push_back(progress.fraction); });
  ShRefitter refitter(renderer, scene.model, scene.Targets(), ColorEdit::Tint({0.3f, 0.8f, 1.2f}),
                      scene.shares, options, monitor);
  EXPECT_EQ(std::memcmp(refitter.Sh().data(), scene.model.sh.data(),
                        scene.model.sh.size() * sizeof(float)),
            0);
  for (int step = 0; step < 120; ++step) ASSERT_TRUE(refitter.Step(monitor));
  EXPECT_EQ(refitter.losses().size(), 2u);
  const RefitSummary summary = refitter.Summary();
  EXPECT_EQ(summary.iterations, 120);
  EXPECT_FALSE(summary.converged);
  EXPECT_EQ(summary.reason, "");
  EXPECT_TRUE(std::is_sorted(fractions.begin(), fractions.end()));
  EXPECT_LT(fractions.back(), 1);  // there is no end to be near to
}

TEST(AdamTest, SeedDecidesTheOrderOfViews) {
  TinyScene scene(33);
  RefitOptions options;
  options.solver = Solver::kAdam;
  options.adam.iterations = 10;
  RefitSummary summary;
  const auto first = FitSh(scene, options, &summary);
  const auto again = FitSh(scene, options, &summary);
  EXPECT_EQ(std::memcmp(first.data(), again.data(), first.size() * sizeof(float)), 0);
  options.adam.seed = 1;
  EXPECT_NE(FitSh(scene, options, &summary), first);
}

TEST(AdamTest, StreamsViewsThatDoNotFit) {
  TinyScene scene(34);
  RefitOptions options;
  options.solver = Solver::kAdam;
  options.adam.iterations = 12;
  options.adam.learning_rate = 1e-2;
  RefitSummary summary;
  const auto kept = FitSh(scene, options, &summary);
  options.region_cache_mb = 0;
  const auto streamed = FitSh(scene, options, &summary);
  // The sign of L1's gradient flips where a residual is near 0: a few steps of 1e-2 apart at most.
  double difference = 0;
  for (size_t i = 0; i < kept.size(); ++i) {
    difference += std::abs(double(kept[i]) - streamed[i]) / double(kept.size());
  }
  EXPECT_LT(difference, 2e-3);
}

}  // namespace
}  // namespace retint
