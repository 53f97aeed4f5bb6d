// SPDX-License-Identifier: BSD-3-Clause
#include "render/renderer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "tests/support/blend.h"

namespace retint {
namespace {

using ::testing::HasSubstr;

constexpr float kShDc = 0.28209479177387814f;  // Y_00

// `count` opaque-ish coloured blobs in front of a camera at the origin, of SH degree 1.
GaussianModel Blobs(int count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> unit(-1, 1);
  GaussianModel model;
  model.Resize(size_t(count), 1);
  for (int i = 0; i < count; ++i) {
    const auto g = size_t(i);
    model.means[3 * g] = 0.8f * unit(random);
    model.means[3 * g + 1] = 0.6f * unit(random);
    model.means[3 * g + 2] = 3 + unit(random);
    for (int k = 0; k < 4; ++k) model.quats_wxyz[4 * g + k] = unit(random);
    for (int k = 0; k < 3; ++k) model.log_scales[3 * g + k] = -2.5f + 0.5f * unit(random);
    model.opacity_logits[g] = 2 * unit(random);
    for (int k = 0; k < 12; ++k) model.sh[12 * g + k] = (k < 3 ? 1.5f : 0.2f) * unit(random);
  }
  return model;
}

PosedCamera Front(int width = 96, int height = 64, double cx = 48, double cy = 32) {
  return {Camera::Pinhole(7, width, height, 80, 80, cx, cy), Rigid3d{}};
}

TEST(ToCameraParams, CarriesPoseAndIntrinsics) {
  PosedCamera view = Front(96, 64, 40.5, 20.25);
  // Unnormalised on purpose: files hold seven digits.
  view.cam_from_world.rotation = Eigen::Quaterniond(2, 0, 0, 2);
  view.cam_from_world.translation = {1, 2, 3};
  const CameraParams params = ToCameraParams(view);
  EXPECT_EQ(params.fx, 80);
  EXPECT_EQ(params.cx, 40.5f);
  EXPECT_EQ(params.cy, 20.25f);
  EXPECT_EQ(params.width, 96);
  EXPECT_EQ(params.height, 64);
  // A quarter turn about z: row-major (0 -1 0; 1 0 0; 0 0 1); the centre is -R^T t = (-2, 1, -3).
  EXPECT_NEAR(params.rotation[1], -1, 1e-6);
  EXPECT_NEAR(params.rotation[3], 1, 1e-6);
  EXPECT_NEAR(params.center[0], -2, 1e-6);
  EXPECT_NEAR(params.center[1], 1, 1e-6);
  EXPECT_NEAR(params.center[2], -3, 1e-6);
}

TEST(ToCameraParams, RefusesDistortedModels) {
  PosedCamera view = Front();
  view.camera.model = CameraModelId::kOpenCV;
  view.camera.params = {80, 80, 48, 32, 0.1, 0, 0, 0};
  try {
    ToCameraParams(view);
    FAIL() << "a distorted camera was taken";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("camera 7"));
    EXPECT_THAT(error.what(), HasSubstr("OPENCV"));
    EXPECT_THAT(error.what(), HasSubstr("colmap image_undistorter"));
  }
}

TEST(ToCameraParams, RefusesUnusableCameras) {
  PosedCamera view = Front();
  view.camera.params[0] = 0;
  EXPECT_THROW(ToCameraParams(view), InputError);
  view = Front(0, 64);
  EXPECT_THROW(ToCameraParams(view), InputError);
  view = Front();
  view.cam_from_world.translation.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(ToCameraParams(view), InputError);
  view = Front();
  view.camera.params.pop_back();
  EXPECT_THROW(ToCameraParams(view), InputError);
}

TEST(Renderer, DrawsOneGaussianWhereItProjects) {
  GaussianModel model;
  model.Resize(1, 0);
  model.means = {0.5f, -0.25f, 2};
  model.quats_wxyz = {1, 0, 0, 0};
  model.log_scales.assign(3, std::log(0.05f));
  model.opacity_logits = {std::log(0.9f / 0.1f)};
  model.sh = {(0.8f - 0.5f) / kShDc, (0.2f - 0.5f) / kShDc, 0};
  Renderer renderer(CreateBackend("cpu"), model, {.background = {0, 0, 1}});
  // 80 * 0.5 / 2 + 48.5 = 68.5 and 80 * -0.25 / 2 + 32.5 = 22.5: the centre of pixel (68, 22).
  const auto out = renderer.Render(
      Front(96, 64, 48.5, 32.5),
      {.depth_median = true, .depth_expected = true, .alpha = true, .median_threshold = 0.5f});
  EXPECT_NEAR(out.alpha(68, 22), 0.9f, 1e-5);
  EXPECT_NEAR(out.rgb(68, 22, 0), 0.9f * 0.8f, 1e-5);
  EXPECT_NEAR(out.rgb(68, 22, 1), 0.9f * 0.2f, 1e-5);
  EXPECT_NEAR(out.rgb(68, 22, 2), 0.9f * 0.5f + 0.1f, 1e-5);
  EXPECT_NEAR(out.depth_median(68, 22), 2, 1e-6);
  EXPECT_NEAR(out.depth_expected(68, 22), 2, 1e-5);
  EXPECT_EQ(out.alpha(5, 60), 0);
  EXPECT_EQ(out.rgb(5, 60, 2), 1);
  EXPECT_EQ(out.depth_median(5, 60), 0);
  EXPECT_EQ(out.depth_expected(5, 60), 0);

  // Transmittance is 0.1 behind it: never below a threshold of 0.05.
  const auto deep = renderer.Render(
      Front(96, 64, 48.5, 32.5), {.rgb = false, .depth_median = true, .median_threshold = 0.05f});
  EXPECT_EQ(deep.depth_median(68, 22), 0);
  EXPECT_TRUE(deep.rgb.Empty());
}

TEST(Renderer, AlphaIsTheSameWithAndWithoutColour) {
  Renderer renderer(CreateBackend("cpu"), Blobs(60, 1));
  const auto both = renderer.Render(Front(), {.alpha = true});
  const auto alone =
      renderer.Render(Front(), {.rgb = false, .depth_expected = true, .alpha = true});
  for (size_t i = 0; i < both.alpha.data.size(); ++i) {
    ASSERT_NEAR(both.alpha.data[i], alone.alpha.data[i], 1e-5) << "pixel " << i;
  }
}

TEST(Renderer, PrincipalPointOffCentreMovesTheImage) {
  Renderer renderer(CreateBackend("cpu"), Blobs(60, 2));
  const Image centred = renderer.Render(Front()).rgb;
  const Image moved = renderer.Render(Front(96, 64, 48 + 13, 32 - 9)).rgb;
  int compared = 0;
  for (int y = 9; y < 64; ++y) {
    for (int x = 0; x < 96 - 13; ++x) {
      for (int c = 0; c < 3; ++c) {
        // float rounding of the projected centre, times the steepest slope of a blob
        ASSERT_NEAR(moved(x + 13, y - 9, c), centred(x, y, c), 2e-4) << x << "," << y;
      }
      ++compared;
    }
  }
  EXPECT_GT(compared, 4000);
}

// A corner of a wide picture, as a camera of its own whose principal point lies outside of it.
TEST(Renderer, APartOfAPictureIsWhatItIsInTheWhole) {
  constexpr int kWidth = 200, kHeight = 160, kLeft = 150, kTop = 110;
  GaussianModel model = Blobs(400, 3);
  for (size_t i = 0; i < model.means.size(); ++i) model.means[i] *= i % 3 == 2 ? 1 : 3;
  Renderer renderer(CreateBackend("cpu"), model);
  const Image whole = renderer.Render(Front(kWidth, kHeight, 100, 80)).rgb;
  const Image part =
      renderer.Render(Front(kWidth - kLeft, kHeight - kTop, 100 - kLeft, 80 - kTop)).rgb;
  float largest = 0, most = 0;
  for (int y = 0; y < part.height; ++y) {
    for (int x = 0; x < part.width; ++x) {
      for (int c = 0; c < 3; ++c) {
        largest = std::max(largest, whole(x + kLeft, y + kTop, c));
        most = std::max(most, std::abs(part(x, y, c) - whole(x + kLeft, y + kTop, c)));
      }
    }
  }
  EXPECT_GT(largest, 0.5f);
  // Gaussians far beyond a side are clamped at another slope. Their part in the picture is faint.
  EXPECT_LT(most, 0.01f);
}

TEST(Renderer, KeepsTheMostRecentViewsWithinItsBudget) {
  const auto backend = CreateBackend("cpu");
  const GaussianModel model = Blobs(60, 3);
  const PosedCamera a = Front(), b = Front(96, 64, 47, 32), c = Front(96, 64, 46, 32);
  size_t largest = 0;
  {
    Renderer measure(backend, model);
    for (const auto& view : {a, b, c}) largest = std::max(largest, measure.Geometry(view)->bytes());
  }
  Renderer renderer(backend, model, {.cache_bytes = 2 * largest});
  const auto first = renderer.Geometry(a);
  const auto second = renderer.Geometry(b);
  EXPECT_EQ(renderer.cached_bytes(), first->bytes() + second->bytes());
  EXPECT_EQ(renderer.Geometry(a), first);  // now b is the least recently used
  const auto third = renderer.Geometry(c);
  EXPECT_LE(renderer.cached_bytes(), 2 * largest);
  EXPECT_EQ(renderer.Geometry(c), third);
  EXPECT_EQ(renderer.Geometry(a), first);
  EXPECT_NE(renderer.Geometry(b), second);  // had been evicted
}

TEST(Renderer, KeepsNothingWithoutABudgetOrWhenAskedNotTo) {
  const auto backend = CreateBackend("cpu");
  const GaussianModel model = Blobs(20, 4);
  Renderer tiny(backend, model, {.cache_bytes = 16});
  EXPECT_NE(tiny.Geometry(Front()), tiny.Geometry(Front()));
  EXPECT_EQ(tiny.cached_bytes(), 0u);
  Renderer renderer(backend, model);
  renderer.Render(Front(), {.cache = false});
  EXPECT_EQ(renderer.cached_bytes(), 0u);
  EXPECT_FALSE(renderer.HasGeometry(Front()));
  renderer.Render(Front());
  EXPECT_GT(renderer.cached_bytes(), 0u);
  EXPECT_TRUE(renderer.HasGeometry(Front()));
}

TEST(Renderer, SetShChangesColoursAndKeepsTheGeometry) {
  GaussianModel model = Blobs(60, 5);
  Renderer renderer(CreateBackend("cpu"), model);
  const Image before = renderer.Render(Front()).rgb;
  const auto geometry = renderer.Geometry(Front());
  const FloatArray original = model.sh;
  for (float& value : model.sh) value *= 0.5f;
  renderer.SetSh(model.sh);
  EXPECT_EQ(renderer.Geometry(Front()), geometry);
  const Image after = renderer.Render(Front()).rgb;
  const Image fresh = Renderer(CreateBackend("cpu"), model).Render(Front()).rgb;
  EXPECT_EQ(after.data, fresh.data);
  EXPECT_NE(after.data, before.data);
  renderer.SetSh(original);
  EXPECT_EQ(renderer.Render(Front()).rgb.data, before.data);
  EXPECT_THROW(renderer.SetSh(std::span(original).first(5)), OptionError);
}

TEST(Renderer, UsesArraysOfTheRightSizeAgain) {
  Renderer renderer(CreateBackend("cpu"), Blobs(60, 5));
  const RenderRequest all = {.depth_median = true, .depth_expected = true, .alpha = true};
  const RenderOutput expected = renderer.Render(Front(), all);
  RenderOutput output;
  output.rgb = Image(3, 2, 7.0f);
  renderer.Render(Front(), all, &output);
  EXPECT_EQ(output.rgb.data, expected.rgb.data);
  const float* pixels = output.rgb.data.data();
  const DepthMap taken = std::move(output.depth_median);
  renderer.Render(Front(), all, &output);
  EXPECT_EQ(output.rgb.data.data(), pixels);
  EXPECT_EQ(output.rgb.data, expected.rgb.data);
  EXPECT_EQ(output.depth_median.data, expected.depth_median.data);
  EXPECT_EQ(output.depth_expected.data, expected.depth_expected.data);
  EXPECT_EQ(output.alpha.data, expected.alpha.data);
  renderer.Render(Front(), {.rgb = false, .alpha = true}, &output);
  EXPECT_TRUE(output.rgb.Empty() && output.depth_median.Empty() && output.depth_expected.Empty());
  EXPECT_EQ(output.alpha.width, expected.alpha.width);
  EXPECT_EQ(output.alpha.data.size(), expected.alpha.data.size());
}

TEST(Renderer, GeometryBlendsAndTransposes) {
  const GaussianModel model = Blobs(200, 7);
  Renderer renderer(CreateBackend("cpu"), model);
  std::mt19937 random(8);
  std::uniform_real_distribution<float> unit(0, 1);
  const auto alpha = renderer.Render(Front(), {.rgb = false, .alpha = true}).alpha;
  for (const int channels : {1, 3, kMaxChannels}) {
    std::vector<float> c(200 * size_t(channels)), r(96 * 64 * size_t(channels));
    for (float& value : r) value = unit(random);
    for (size_t i = 0; i < c.size(); ++i) c[i] = float(i % size_t(channels) + 1);
    auto forward = BlendFeatures(renderer, Front(), c, channels);
    ASSERT_EQ(forward.size(), r.size());
    for (size_t i = 0; i < r.size(); ++i) {  // a constant feature times W 1
      const auto channel = float(i % size_t(channels) + 1);
      ASSERT_NEAR(forward[i], channel * alpha.data[i / size_t(channels)], 1e-4 * channel);
    }
    for (float& value : c) value = unit(random);
    forward = BlendFeatures(renderer, Front(), c, channels);
    const auto backward = BlendTransposeToGaussians(renderer, Front(), r, channels);
    double left = 0, right = 0;
    for (size_t i = 0; i < r.size(); ++i) left += double(forward[i]) * r[i];
    for (size_t i = 0; i < c.size(); ++i) right += double(backward[i]) * c[i];
    EXPECT_NEAR(left / right, 1, 1e-5) << channels << " channels";
  }
}

TEST(Renderer, ViewWithoutGaussiansIsBackground) {
  GaussianModel model = Blobs(5, 9);
  Renderer renderer(CreateBackend("cpu"), model, {.background = {0.25f, 0.5f, 0.75f}});
  PosedCamera away = Front();
  away.cam_from_world.rotation =
      Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitY()));
  const auto out = renderer.Render(away, {.depth_median = true, .alpha = true});
  EXPECT_EQ(out.rgb(10, 10, 0), 0.25f);
  EXPECT_EQ(out.rgb(95, 63, 2), 0.75f);
  EXPECT_EQ(out.alpha(10, 10), 0);
  EXPECT_EQ(out.depth_median(10, 10), 0);
  const std::vector<float> features(5, 1.0f), residual(96 * 64, 1.0f);
  EXPECT_THAT(BlendFeatures(renderer, away, features), ::testing::Each(0.0f));
  EXPECT_THAT(BlendTransposeToGaussians(renderer, away, residual), ::testing::Each(0.0f));
}

TEST(Renderer, RefusesBadInput) {
  GaussianModel model = Blobs(3, 10);
  const auto backend = CreateBackend("cpu");
  EXPECT_THROW(
      Renderer(backend, model, {.background = {0, std::numeric_limits<float>::infinity(), 0}}),
      OptionError);
  model.means[4] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(Renderer(backend, model), InputError);
}

}  // namespace
}  // namespace retint
