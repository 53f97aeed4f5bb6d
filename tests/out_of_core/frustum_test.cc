// SPDX-License-Identifier: BSD-3-Clause
// Nothing that a view draws may be culled. Culling too little only costs memory.
#include "out_of_core/frustum.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "kernels/backend.h"
#include "render/renderer.h"
#include "tests/splat_io/random_scene.h"

namespace retint {
namespace {

GaussianBounds BoundsOf(const GaussianModel& model, size_t g) {
  GaussianBounds bounds;
  for (size_t i = 0; i < 3; ++i) bounds.low[i] = bounds.high[i] = model.means[3 * g + i];
  const float* const s = &model.log_scales[3 * g];
  bounds.sigma = std::exp(std::max({s[0], s[1], s[2]}));
  return bounds;
}

// A camera somewhere in the scene that looks anywhere, its principal point maybe far off.
PosedCamera RandomCamera(std::mt19937& random) {
  std::uniform_real_distribution<double> unit(-1, 1);
  PosedCamera view;
  const double focal = 40 * std::exp(1.5 * unit(random));
  view.camera = Camera::Pinhole(1, 70, 50, focal, focal * (1 + 0.3 * unit(random)),
                                35 + 60 * unit(random), 25 + 40 * unit(random));
  Eigen::Quaterniond rotation(unit(random), unit(random), unit(random), unit(random));
  view.cam_from_world.rotation = rotation.normalized();
  view.cam_from_world.translation = {4 * unit(random), 4 * unit(random), 4 * unit(random)};
  return view;
}

TEST(Frustum, KeepsWhateverAViewDraws) {
  const auto backend = CreateBackend("cpu");
  GaussianModel model = RandomScene(20000, 0, 3);
  // Needles too, whose conics round.
  for (size_t g = 0; g < 5000; ++g) model.log_scales[3 * g + g % 3] = 1.5F;
  Renderer renderer(backend, model);
  std::mt19937 random(7);
  int64_t drawn = 0, kept = 0;
  constexpr int kViews = 40;
  for (int v = 0; v < kViews; ++v) {
    const PosedCamera view = RandomCamera(random);
    const Frustum frustum(ToCameraParams(view));
    const auto geometry = renderer.Geometry(view, /*cache=*/false);
    drawn += geometry->num_rows();
    for (int64_t row = 0; row < geometry->num_rows(); ++row) {
      const auto g = static_cast<size_t>(geometry->rows()[row]);
      ASSERT_TRUE(frustum.MaySee(BoundsOf(model, g))) << "view " << v << ", Gaussian " << g;
    }
    for (size_t g = 0; g < model.NumGaussians(); ++g) kept += frustum.MaySee(BoundsOf(model, g));
  }
  // It culls: the views see a part of a scene all about them. Large Gaussians make the bound loose.
  EXPECT_GT(drawn, kViews * 100);
  EXPECT_LT(kept, kViews * 20000 * 2 / 3);
}

TEST(Frustum, KeepsABoxThatHoldsASeenPoint) {
  std::mt19937 random(8);
  std::uniform_real_distribution<float> draw(0, 2);
  int seen = 0;
  for (int i = 0; i < 2000; ++i) {
    const PosedCamera view = RandomCamera(random);
    const Frustum frustum(ToCameraParams(view));
    GaussianBounds point;
    for (size_t k = 0; k < 3; ++k) point.low[k] = point.high[k] = 5 * draw(random) - 5;
    GaussianBounds box = point;
    for (size_t k = 0; k < 3; ++k) {
      box.low[k] -= draw(random);
      box.high[k] += draw(random);
    }
    if (!frustum.MaySee(point)) continue;
    ++seen;
    EXPECT_TRUE(frustum.MaySee(box));
  }
  EXPECT_GT(seen, 30);
}

TEST(Frustum, LeavesOutWhatLiesBehindOrBeside) {
  PosedCamera view;
  view.camera = Camera::Pinhole(1, 64, 64, 64, 64, 32, 32);
  const Frustum frustum(ToCameraParams(view));
  const auto at = [](float x, float y, float z, float sigma) {
    GaussianBounds bounds;
    bounds.low = bounds.high = {x, y, z};
    bounds.sigma = sigma;
    return bounds;
  };
  EXPECT_TRUE(frustum.MaySee(at(0, 0, 5, 0.01F)));
  EXPECT_FALSE(frustum.MaySee(at(0, 0, -5, 0.01F)));
  EXPECT_FALSE(frustum.MaySee(at(0, 0, -5, 10)));  // its mean is behind the near plane
  EXPECT_FALSE(frustum.MaySee(at(5, 0, 5, 0.01F)));
  EXPECT_FALSE(frustum.MaySee(at(0, -5, 5, 0.01F)));
  EXPECT_TRUE(frustum.MaySee(at(5, 0, 5, 1)));  // two and a half meters beside the edge
}

}  // namespace
}  // namespace retint
