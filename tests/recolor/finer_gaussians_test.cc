// SPDX-License-Identifier: BSD-3-Clause
// Split Gaussians look the same, and can show finer detail.
#include "recolor/finer_gaussians.h"

#include <cmath>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "base/error.h"
#include "tests/recolor/tiny_scene.h"

namespace retint {
namespace {

constexpr PartSize kStay;
constexpr float kPixel = 4 / 70.0f;  // at the origin
constexpr PartSize kFine = {1.2f * kPixel, 0.5477f * kPixel};

// A long, tilted Gaussian before the origin's cameras, and a small one beside it.
GaussianModel TwoGaussians(double opacity) {
  GaussianModel model;
  model.Resize(2, 1);
  SetGaussian(model, 0, {0, 0, 0}, 0.5, std::log(opacity / (1 - opacity)));
  model.log_scales[1] = std::log(0.25f);
  model.log_scales[2] = std::log(0.01f);
  const Eigen::Quaternionf tilt(
      Eigen::AngleAxisf(0.6f, Eigen::Vector3f(0.3f, 0.2f, 1).normalized()));
  const float quat[4] = {tilt.w(), tilt.x(), tilt.y(), tilt.z()};
  std::copy_n(quat, 4, model.quats_wxyz.begin());
  SetGaussian(model, 1, {1.2, 0.4, 0}, 0.03, 2);
  for (float& value : model.sh) value = 0.7f;
  return model;
}

TEST(FinerGaussians, PartsLookAsTheirParentDid) {
  const auto backend = std::shared_ptr<Backend>(CreateBackend("cpu"));
  const PosedCamera camera = LookAtOrigin(0.3, 4.0);
  for (const double opacity : {0.3, 0.8, 0.97}) {
    const GaussianModel model = TwoGaussians(opacity);
    const FinerGaussians finer = SplitGaussians(model, std::vector<PartSize>{kFine, kStay});
    ASSERT_GT(finer.model.NumGaussians(), 20u);
    ASSERT_EQ(finer.stayed, 1u);
    EXPECT_NO_THROW(finer.model.Validate());
    Renderer before(backend, model), after(backend, finer.model);
    const Image one = before.Render(camera).rgb, other = after.Render(camera).rgb;
    double sum = 0, most = 0;
    for (size_t i = 0; i < one.data.size(); ++i) {
      const double difference = std::abs(double(one.data[i]) - double(other.data[i]));
      sum += difference;
      most = std::max(most, difference);
    }
    EXPECT_LT(sum / double(one.data.size()), 0.008) << opacity;
    EXPECT_LT(most, 0.06) << opacity;
  }
}

TEST(FinerGaussians, OneOfVeryManyPartsHasLargerOnes) {
  const GaussianModel model = TwoGaussians(0.8);
  const PartSize tiny = {1e-3f, 1e-4f};
  const FinerGaussians finer = SplitGaussians(model, std::vector<PartSize>{tiny, kStay});
  EXPECT_GT(finer.parents.size() - finer.stayed, 2000u);
  EXPECT_LE(finer.parents.size() - finer.stayed, 4096u);
}

TEST(FinerGaussians, WhatStaysKeepsItsBits) {
  GaussianModel model = TwoGaussians(0.8);
  model.source.extras = {{"label", "uchar", 1, {'a', 'b'}}};
  const FinerGaussians finer = SplitGaussians(model, std::vector<PartSize>{kFine, kStay});
  EXPECT_EQ(finer.parents.front(), 1);
  EXPECT_EQ(finer.model.means[0], model.means[3]);
  EXPECT_EQ(finer.model.opacity_logits[0], model.opacity_logits[1]);
  ASSERT_EQ(finer.model.source.extras.size(), 1u);
  const std::vector<char>& labels = finer.model.source.extras[0].bytes;
  ASSERT_EQ(labels.size(), finer.model.NumGaussians());
  EXPECT_EQ(labels.front(), 'b');
  EXPECT_EQ(labels.back(), 'a');
  const FinerGaussians same = SplitGaussians(model, std::vector<PartSize>{kStay, kStay});
  EXPECT_EQ(same.model.means, model.means);
  EXPECT_EQ(same.model.sh, model.sh);
}

// A wall of large Gaussians.
struct Wall {
  GaussianModel model;
  std::vector<PosedCamera> cameras;
  std::vector<Mask> masks;

  Wall() {
    model.Resize(24, 1);
    for (size_t g = 0; g < 24; ++g) {
      SetGaussian(model, g, {0.45 * (double(g % 6) - 2.5), 0.45 * (double(g / 6) - 1.5), 0}, 0.25,
                  2.5);
      model.log_scales[3 * g + 2] = std::log(0.01f);
      for (size_t c = 0; c < 3; ++c) model.sh[12 * g + c] = 1;
    }
    for (const double azimuth : {-0.3, -0.1, 0.1, 0.3}) {
      cameras.push_back(LookAtOrigin(azimuth, 4.0));
      masks.emplace_back(64, 48, uint8_t{255});
    }
  }

  std::vector<RefitTarget> Targets() const {
    std::vector<RefitTarget> targets;
    for (size_t v = 0; v < cameras.size(); ++v) targets.push_back({"view", cameras[v], &masks[v]});
    return targets;
  }

  // Of a fit of `fitted` to black stripes, 7 pixels wide, over the wall; mean squared error.
  double StripesError(const GaussianModel& fitted) const {
    const auto backend = std::shared_ptr<Backend>(CreateBackend("cpu"));
    Renderer plain(backend, model), renderer(backend, fitted);
    std::vector<Image> photos;
    for (const PosedCamera& camera : cameras) {
      Image photo = plain.Render(camera).rgb;
      for (int y = 0; y < photo.height; ++y) {
        for (int x = 0; x < photo.width; ++x) {
          const Eigen::Vector3d ray = camera.Unproject({x + 0.5, y + 0.5}, 1) - camera.Center();
          const Eigen::Vector3d at = camera.Center() - ray * (camera.Center().z() / ray.z());
          if (int(std::floor(at.x() / 0.4)) % 2 == 0) continue;
          for (int c = 0; c < 3; ++c) photo(x, y, c) *= 0.1f;
        }
      }
      photos.push_back(std::move(photo));
    }
    std::vector<RefitTarget> targets = Targets();
    for (size_t v = 0; v < targets.size(); ++v) targets[v].photo = HeldPhoto(photos[v]);
    Monitor monitor;
    ShRefitter refitter(renderer, fitted, targets, ColorEdit::Tint({1, 1, 1}),
                        std::vector<float>(fitted.NumGaussians(), 1.0f), {}, monitor);
    refitter.Run(monitor);
    renderer.SetSh(refitter.Sh());
    double sum = 0, count = 0;
    for (size_t v = 0; v < cameras.size(); ++v) {
      const Image found = renderer.Render(cameras[v]).rgb;
      for (size_t i = 0; i < found.data.size(); ++i, ++count) {
        const double difference = double(found.data[i]) - double(photos[v].data[i]);
        sum += difference * difference;
      }
    }
    return sum / count;
  }
};

Refinement Refine(const Wall& wall, const RefineOptions& options = {}) {
  Renderer renderer(CreateBackend("cpu"), wall.model);
  Monitor monitor;
  return RefineGaussians(renderer, wall.model, wall.Targets(), {}, options, monitor);
}

TEST(FinerGaussians, ARefinedWallShowsStripes) {
  const Wall wall;
  const Refinement refined = Refine(wall);
  EXPECT_EQ(refined.summary.split, 24u);
  EXPECT_GT(refined.summary.psnr, 40);
  EXPECT_GE(refined.summary.psnr, refined.summary.psnr_split);
  const double before = wall.StripesError(wall.model);
  EXPECT_LT(wall.StripesError(refined.finer.model), before / 4);
}

TEST(FinerGaussians, ThereAreNoMorePartsThanWanted) {
  const Wall wall;
  RefineOptions options;
  options.most = 1000;
  const Refinement refined = Refine(wall, options);
  EXPECT_LE(refined.finer.model.NumGaussians() - refined.finer.stayed, 1000u);
  EXPECT_GT(refined.finer.model.NumGaussians(), 200u);
  EXPECT_GT(refined.summary.pixels, options.pixels);
}

TEST(FinerGaussians, TheBackgroundIsNotFitted) {
  const Wall wall;
  Renderer renderer(CreateBackend("cpu"), wall.model, {.background = {1, 1, 1}});
  Monitor monitor;
  const Refinement refined = RefineGaussians(renderer, wall.model, wall.Targets(), {}, {}, monitor);
  EXPECT_GT(refined.summary.psnr, 40);
  EXPECT_GE(refined.summary.psnr, refined.summary.psnr_split);
}

TEST(FinerGaussians, RefusesSharesAndMasksThatDoNotFit) {
  Wall wall;
  Renderer renderer(CreateBackend("cpu"), wall.model);
  Monitor monitor;
  const size_t count = wall.model.NumGaussians();
  EXPECT_THROW(RefineGaussians(renderer, wall.model, wall.Targets(),
                               std::vector<float>(count - 1, 0.0f), {}, monitor),
               OptionError);
  wall.masks[0] = Mask(8, 8, 0);
  EXPECT_THROW(RefineGaussians(renderer, wall.model, wall.Targets(),
                               std::vector<float>(count, 0.0f), {}, monitor),
               InputError);
}

TEST(FinerGaussians, OnlyWhatIsInsideTheMasksIsSplit) {
  Wall wall;
  for (Mask& mask : wall.masks) {
    for (int y = 0; y < mask.height; ++y) {
      for (int x = 32; x < mask.width; ++x) mask(x, y) = 0;
    }
  }
  const Refinement refined = Refine(wall);
  EXPECT_EQ(refined.summary.split, 12u);
  EXPECT_EQ(refined.finer.stayed, 12u);
  for (size_t g = 0; g < refined.finer.stayed; ++g) {
    const auto parent = size_t(refined.finer.parents[g]);
    EXPECT_GT(wall.model.means[3 * parent], 0);
    for (size_t k = 0; k < 12; ++k) {
      EXPECT_EQ(refined.finer.model.sh[12 * g + k], wall.model.sh[12 * parent + k]);
    }
  }
}

}  // namespace
}  // namespace retint
