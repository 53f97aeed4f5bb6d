// SPDX-License-Identifier: BSD-3-Clause
#include "recolor/mm_solver.h"

#include <cstring>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "base/error.h"
#include "recolor/quality_report.h"
#include "tests/recolor/tiny_scene.h"
#include "tests/support/closed_form.h"

namespace retint {
namespace {

// Of the squares alone.
RefitOptions Exhaustive(int sweeps) {
  RefitOptions options;
  options.mm.outside_slope = 0;
  options.mm.iterations = sweeps;
  options.mm.tolerance = 0;
  return options;
}

RefitSummary Refit(TinyScene& scene, const ColorEdit& edit, const RefitOptions& options,
                   FloatArray* sh = nullptr) {
  Renderer renderer = scene.MakeRenderer();
  Monitor monitor;
  ShRefitter refitter(renderer, scene.model, scene.Targets(), edit, scene.shares, options, monitor);
  const RefitSummary summary = refitter.Run(monitor);
  if (sh) *sh = refitter.Sh();
  return summary;
}

// Of the renders of all views.
double SquaredError(const TinyScene& scene, const ColorEdit& edit, const FloatArray& sh) {
  const CompiledEdit compiled(edit);
  Renderer original = scene.MakeRenderer(), renderer = scene.MakeRenderer();
  renderer.SetSh(sh);
  double error = 0;
  for (size_t v = 0; v < scene.cameras.size(); ++v) {
    const Image before = original.Render(scene.cameras[v]).rgb;
    const Image after = renderer.Render(scene.cameras[v]).rgb;
    for (size_t p = 0; p < scene.masks[v].data.size(); ++p) {
      const auto color = Eigen::Map<const Eigen::Vector3f>(&before.data[3 * p]);
      const auto now = Eigen::Map<const Eigen::Vector3f>(&after.data[3 * p]);
      error += (compiled.Apply(color, float(scene.masks[v].data[p]) / 255) - now).squaredNorm();
    }
  }
  return error;
}

// The error of the renders at the start, the closed form.
double StartError(const TinyScene& scene, const ColorEdit& edit) {
  return SquaredError(
      scene, edit,
      ClosedFormSh(*scene.backend, scene.model.sh, scene.model.NumShCoeffs(), scene.shares, edit));
}

// A tint that keeps every color off the clamp, where the loss is a square. Renders show the gain
// that each sweep reports. The loss leaves out pixels that no selected Gaussian covers.
TEST(MmTest, SweepsNeverRaiseTheLoss) {
  TinyScene scene(21);
  scene.FillMasks(255);  // all pixels weigh the same, as they do in SquaredError()
  for (float& value : scene.model.sh) value *= 0.4f;
  const ColorEdit edit = ColorEdit::Tint({0.5f, 1.2f, 0.8f});
  const double start = StartError(scene, edit);
  std::vector<double> seen = {0}, reported = {0};  // gains
  for (const int sweeps : {1, 2, 4, 8, 16, 300}) {
    RefitOptions options = Exhaustive(sweeps);
    options.mm.ridge_dc = options.mm.ridge_rest = 1e-7;
    FloatArray end;
    const auto losses = Refit(scene, edit, options, &end).losses;
    reported.push_back(losses.front() - losses.back());
    seen.push_back(start - SquaredError(scene, edit, end));
    EXPECT_GT(seen.back(), seen[seen.size() - 2]) << sweeps;
  }
  EXPECT_GT(seen.back(), 0.03 * start);
  for (size_t i = 1; i < seen.size(); ++i) {
    // Weights of 8 bits miss 2e-3 of it.
    EXPECT_NEAR(seen[i] / seen.back(), reported[i] / reported.back(), 1e-2) << i;
  }
}

// The default fit changes its function after a few sweeps. Both figures are of the second one.
TEST(MmTest, LossesAreOfOneFunction) {
  TinyScene scene(21);
  const ColorEdit edit = ColorEdit::Tint({0.2f, 0.6f, 1.3f});
  RefitOptions options;
  options.mm.tolerance = 1e-12;
  const std::vector<double> losses = Refit(scene, edit, options).losses;
  ASSERT_GT(losses.size(), 3u);
  for (size_t i = 1; i < losses.size(); ++i) EXPECT_LE(losses[i], losses[i - 1] * (1 + 1e-6)) << i;
  // Of the closed form, which both start from, the size of changes counts beside their square.
  options.mm.outside_slope = 0;
  EXPECT_GT(losses.front(), Refit(scene, edit, options).losses.front());
}

// |W c|^2 <= sum_g (W^T 1)_g c_g^2 per channel: the weights of a pixel sum to at most 1.
TEST(MmTest, VisibilityMajorisesTheBlend) {
  TinyScene scene(22);
  Renderer renderer = scene.MakeRenderer();
  TestRandom random(5);
  const size_t count = scene.model.NumGaussians();
  for (const auto& camera : scene.cameras) {
    const auto visibility =
        BlendTransposeToGaussians(renderer, camera, std::vector<float>(64 * 48, 1.0f));
    std::vector<float> values(count);
    for (float& value : values) value = float(random.Uniform(-1, 1));
    double blended = 0, bound = 0;
    for (const float y : BlendFeatures(renderer, camera, values)) blended += double(y) * y;
    for (size_t g = 0; g < count; ++g) bound += double(visibility[g]) * values[g] * values[g];
    EXPECT_GT(blended, 0);
    EXPECT_LE(blended, bound);
  }
}

// Photos of a scene whose selected Gaussians were recoloured with SH that no tint can make: the
// refit has to find them.
TEST(MmTest, RecoversAKnownEdit) {
  TinyScene scene(24);
  GaussianModel edited = scene.model;
  TestRandom random(9);
  const size_t block = size_t(scene.model.NumShCoeffs()) * 3;
  for (size_t g = 0; g < scene.shares.size(); ++g) {
    if (scene.shares[g] == 0) continue;
    for (size_t i = 0; i < block; ++i) {
      edited.sh[g * block + i] += float(random.Uniform(0, i < 3 ? 0.8 : 0.05));
    }
  }
  Renderer truth(scene.backend, edited);
  for (const auto& camera : scene.cameras) scene.photos.push_back(truth.Render(camera).rgb);
  RefitOptions options = Exhaustive(200);
  options.mm.ridge_dc = options.mm.ridge_rest = 1e-7;
  FloatArray sh;
  const auto summary = Refit(scene, ColorEdit(), options, &sh);
  EXPECT_GT(summary.changed_gaussians, 20);
  Renderer renderer = scene.MakeRenderer();
  renderer.SetSh(sh);
  double error = 0, start = 0;
  size_t values = 0;
  Renderer original = scene.MakeRenderer();
  for (size_t v = 0; v < scene.cameras.size(); ++v) {
    const Image image = renderer.Render(scene.cameras[v]).rgb;
    const Image before = original.Render(scene.cameras[v]).rgb;
    for (size_t i = 0; i < image.data.size(); ++i, ++values) {
      error += std::pow(double(image.data[i]) - scene.photos[v].data[i], 2);
      start += std::pow(double(before.data[i]) - scene.photos[v].data[i], 2);
    }
  }
  // 60 dB: the 16-bit targets alone allow about 80.
  EXPECT_LT(error / double(values), 1e-6);
  EXPECT_GT(start / double(values), 1e-4);
}

TEST(MmTest, AgreesWithAndWithoutKeptRegions) {
  TinyScene scene(25);
  const ColorEdit edit = ColorEdit::Tint({0.4f, 0.9f, 1.1f});
  RefitOptions options = Exhaustive(8);
  FloatArray kept, streamed;
  Refit(scene, edit, options, &kept);
  options.region_cache_mb = 0;
  Refit(scene, edit, options, &streamed);
  // Kept weights are rounded to 8 bits and cut off at 1e-3. So single coefficients of faint
  // Gaussians may differ, but not the mean over active ones.
  double difference = 0, change = 0;
  for (size_t i = 0; i < kept.size(); ++i) {
    difference += std::abs(double(kept[i]) - double(streamed[i]));
    change += std::abs(double(kept[i]) - double(scene.model.sh[i]));
  }
  EXPECT_GT(change, 0);
  EXPECT_LT(difference, 0.03 * change);
}

// Less weight outside buys accuracy inside, more of it the contrary, also above the weight inside.
TEST(MmTest, OutsideWeightTradesOutsideForInside) {
  TinyScene scene(29);
  const ColorEdit edit = ColorEdit::Tint({0.2f, 0.7f, 1.3f});
  std::vector<QualityNumbers> by_weight;
  for (const double weight : {0.2, 1.0, 4.0}) {
    RefitOptions options = Exhaustive(60);
    options.mm.outside_weight = weight;
    FloatArray sh;
    Refit(scene, edit, options, &sh);
    Renderer renderer = scene.MakeRenderer();
    Monitor monitor;
    by_weight.push_back(
        EvaluateEdit(renderer, scene.model.sh, sh, scene.Targets(), {}, edit, monitor).train);
  }
  for (size_t i = 1; i < by_weight.size(); ++i) {
    EXPECT_LT(by_weight[i].psnr_inside_after, by_weight[i - 1].psnr_inside_after);
    EXPECT_GT(by_weight[i].psnr_outside, by_weight[i - 1].psnr_outside);
  }
}

// Changes outside cost their size too: fewer Gaussians change there, and inside they still do.
TEST(MmTest, LeavesMoreUnchangedByTheSizeOfChanges) {
  TinyScene scene(31);
  for (float& value : scene.model.sh) value *= 0.4f;
  for (Mask& mask : scene.masks) {
    for (uint8_t& m : mask.data) m = m > 127 ? 255 : 0;  // so that the edit shows outside
  }
  const ColorEdit edit = ColorEdit::Tint({0.4f, 0.8f, 1.2f});
  double outside[2], inside[2];
  for (const bool by_size : {false, true}) {
    RefitOptions options = Exhaustive(60);
    if (by_size) options.mm.outside_slope = 12;
    FloatArray sh;
    const RefitSummary summary = Refit(scene, edit, options, &sh);
    // The loss is another one once, and from then on falls again.
    int rises = 0;
    for (size_t i = 1; i < summary.losses.size(); ++i) {
      rises += summary.losses[i] > summary.losses[i - 1] * (1 + 1e-6);
    }
    EXPECT_LE(rises, by_size ? 1 : 0);
    Renderer renderer = scene.MakeRenderer(), original = scene.MakeRenderer();
    renderer.SetSh(sh);
    double sum = 0;
    size_t count = 0;
    for (size_t v = 0; v < scene.cameras.size(); ++v) {
      const Image now = renderer.Render(scene.cameras[v]).rgb;
      const Image before = original.Render(scene.cameras[v]).rgb;
      for (size_t i = 0; i < now.data.size(); ++i) {
        if (scene.masks[v].data[i / 3] > 0) continue;
        sum += std::abs(double(now.data[i]) - double(before.data[i]));
        ++count;
      }
    }
    ASSERT_GT(count, 1000u);
    outside[by_size] = sum / double(count);
    Monitor monitor;
    inside[by_size] = EvaluateEdit(renderer, scene.model.sh, sh, scene.Targets(), {}, edit, monitor)
                          .train.psnr_inside_after;
  }
  EXPECT_LT(outside[1], 0.95 * outside[0]);
  EXPECT_GT(inside[1], inside[0] - 4);
}

TEST(MmTest, IsDeterministic) {
  TinyScene scene(26);
  FloatArray first, second;
  const ColorEdit edit = ColorEdit::Tint({0.4f, 0.9f, 1.1f});
  Refit(scene, edit, RefitOptions(), &first);
  Refit(scene, edit, RefitOptions(), &second);
  EXPECT_EQ(std::memcmp(first.data(), second.data(), first.size() * sizeof(float)), 0);
}

// Tints to nearly 0 drive whole channels onto the clamp, where the problem is not quadratic.
// Renders say how much of the error goes: only losses that fell are reported.
TEST(MmTest, EndsNoWorseThanItStartedOnTheClamp) {
  TinyScene scene(27);
  scene.FillMasks(255);
  // The part of the first error that is left, after 200 sweeps as after these twelve. Steps that do
  // not keep their reported values leave 8e-5 more, or 0.02.
  const std::pair<Eigen::Vector3f, double> cases[] = {{{0, 1, 0.3f}, 0.99523},
                                                      {{3, 0, 0.1f}, 0.968}};
  for (const auto& [tint, most] : cases) {
    const ColorEdit edit = ColorEdit::Tint(tint);
    FloatArray end;
    Refit(scene, edit, Exhaustive(12), &end);
    EXPECT_LT(SquaredError(scene, edit, end), most * StartError(scene, edit));
  }
}

// The closed form leaves nearly black Gaussians before others that may not change. The gradient
// asks for darker ones still, but the first step meets the clamp, and the loss is no parabola.
TEST(MmTest, ReportsOnlyWhatRendersShowOnTheClamp) {
  for (const uint64_t seed : {27, 28, 35}) {
    TinyScene scene(seed);
    scene.FillMasks(255);
    const ColorEdit edit = ColorEdit::Tint({0.001f, 0.001f, 0.001f});
    const FloatArray start =
        ClosedFormSh(*scene.backend, scene.model.sh, scene.model.NumShCoeffs(), scene.shares, edit);
    FloatArray end;
    const auto losses = Refit(scene, edit, Exhaustive(16), &end).losses;
    // Weights of 8 bits miss 3e-5 of it; promises that are not kept are 5e-3 and more.
    EXPECT_NEAR(losses.back() / losses.front(),
                SquaredError(scene, edit, end) / SquaredError(scene, edit, start), 1e-3);
  }
}

// Changes outside count by their square for five sweeps, and by their size from the sixth on.
TEST(MmTest, CountsTheSizeOfChangesFromTheSixthSweepOn) {
  TinyScene scene(31);
  for (float& value : scene.model.sh) value *= 0.4f;
  const ColorEdit edit = ColorEdit::Tint({0.4f, 0.8f, 1.2f});
  for (const int sweeps : {5, 6}) {
    RefitOptions options = Exhaustive(sweeps);
    FloatArray squares, sizes;
    Refit(scene, edit, options, &squares);
    options.mm.outside_slope = 12;
    Refit(scene, edit, options, &sizes);
    const bool same = std::memcmp(squares.data(), sizes.data(), sizes.size() * sizeof(float)) == 0;
    EXPECT_EQ(same, sweeps == 5);
  }
}

// 0 sweeps is "until it has converged": more than the default when the tolerance asks for more, and
// the same as a limit that is never reached.
TEST(MmTest, NoLimitRunsUntilItHasConverged) {
  TinyScene scene(30);
  const ColorEdit edit = ColorEdit::Tint({0.2f, 0.6f, 1.3f});
  RefitOptions options;
  options.mm.tolerance = 1e-6;
  const RefitSummary limited = Refit(scene, edit, options);
  EXPECT_EQ(limited.iterations, options.mm.iterations);
  EXPECT_FALSE(limited.converged);
  EXPECT_EQ(limited.reason, "all sweeps done");
  FloatArray free_sh, far_sh;
  options.mm.iterations = 0;
  const RefitSummary free = Refit(scene, edit, options, &free_sh);
  EXPECT_GT(free.iterations, limited.iterations);
  EXPECT_LT(free.iterations, MmOptions::kMostSweeps);
  EXPECT_TRUE(free.converged);
  options.mm.iterations = 999;
  EXPECT_EQ(Refit(scene, edit, options, &far_sh).iterations, free.iterations);
  EXPECT_EQ(std::memcmp(free_sh.data(), far_sh.data(), far_sh.size() * sizeof(float)), 0);
}

// A tolerance of 0 never converges by itself here: the safety limit ends it, and says so.
TEST(MmTest, NoLimitStillEnds) {
  TinyScene scene(20, 12, 2, 0);
  RefitOptions options = Exhaustive(0);
  const RefitSummary summary = Refit(scene, ColorEdit::Tint({0.2f, 0.6f, 1.3f}), options);
  EXPECT_EQ(summary.iterations, MmOptions::kMostSweeps);
  EXPECT_FALSE(summary.converged);
  EXPECT_EQ(summary.reason, "all sweeps done");
}

TEST(MmTest, StopsWhenASweepGainsLittle) {
  TinyScene scene(28);
  RefitOptions options;
  options.mm.iterations = 500;
  options.mm.tolerance = 1e-2;
  const auto summary = Refit(scene, ColorEdit::Tint({0.2f, 1, 1}), options);
  EXPECT_TRUE(summary.converged);
  EXPECT_LT(summary.iterations, 500);
  EXPECT_FALSE(summary.reason.empty());
}

}  // namespace
}  // namespace retint
