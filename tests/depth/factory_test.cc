// SPDX-License-Identifier: BSD-3-Clause
#include "depth/factory.h"

#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "colmap_io/workspace.h"
#include "depth/depth_picture.h"
#include "tests/depth/plane_scene.h"

namespace retint {
namespace {

using ::testing::HasSubstr;

const PosedCamera kView{Camera::Pinhole(1, 120, 90, 100, 100, 60, 45), {}};

TEST(DepthFactory, MakesEveryMethodItNames) {
  Renderer renderer(CreateBackend("cpu"), PlaneScene{}.Model(3, 0.1, 1));
  for (const auto& method : DepthMethods()) {
    if (method.starts_with("colmap")) continue;  // below, and in colmap_mvs_test.cc
    Monitor monitor;
    EXPECT_EQ(MakeDepthEstimator(method, renderer)->Estimate(kView, monitor).method, method);
  }
  EXPECT_THAT(DepthMethods(), ::testing::Contains("colmap"));
  EXPECT_THAT(DepthMethodsHelp(), HasSubstr("gaussian (the splat's own), stereo-hv ("));
  EXPECT_THAT(DepthMethodsHelp(), HasSubstr(") or colmap-mvs ("));
  EXPECT_THROW(MakeDepthEstimator("colmap", renderer), OptionError);
  DepthOptions missing;
  missing.colmap_mvs.program = "retint-no-such-program";
  EXPECT_THROW(MakeDepthEstimator("colmap-mvs", renderer, nullptr, missing), OptionError);
  const Workspace empty;
  EXPECT_THROW(MakeDepthEstimator("colmap", renderer, &empty), InputError);
}

TEST(DepthFactory, RefusesUnknownMethodsAndBadOptions) {
  Renderer renderer(CreateBackend("cpu"), PlaneScene{}.Model(3, 0.5, 1));
  try {
    MakeDepthEstimator("sonar", renderer);
    FAIL() << "an unknown method was made";
  } catch (const OptionError& error) {
    EXPECT_THAT(error.what(), HasSubstr("sonar"));
    EXPECT_THAT(error.what(), HasSubstr("stereo-hv"));
  }
  DepthOptions options;
  options.gaussian.tau = 1;
  EXPECT_THROW(MakeDepthEstimator("gaussian", renderer, nullptr, options), OptionError);
}

TEST(GaussianDepth, MedianAndExpectedOnAPlane) {
  const PlaneScene plane{4, 0.2, 0};
  Renderer renderer(CreateBackend("cpu"), plane.Model(2, 0.08, 2));
  using Kind = GaussianDepthOptions::Kind;
  for (const Kind kind : {Kind::kMedian, Kind::kExpected}) {
    Monitor monitor;
    const auto estimate = GaussianDepthEstimator(renderer, {.kind = kind}).Estimate(kView, monitor);
    EXPECT_NEAR(estimate.depth(60, 45) / plane.Depth(kView.camera, 60.5, 45.5), 1, 0.02);
    EXPECT_EQ(estimate.valid(60, 45), 255);
    // The plane ends at 2 / 4 * 100 = 50 pixels from the centre: the corners see nothing.
    EXPECT_EQ(estimate.depth(1, 1), 0);
    EXPECT_EQ(estimate.valid(1, 1), 0);
    EXPECT_GT(estimate.valid_fraction, 0.7);
    EXPECT_LT(estimate.valid_fraction, 0.99);
    EXPECT_THAT(estimate.reason, HasSubstr(kind == Kind::kMedian ? "median" : "expected"));
  }
  EXPECT_THROW(GaussianDepthEstimator(renderer, {.min_alpha = 0}), OptionError);
}

TEST(DepthPicture, NearIsWarmFarIsColdUnknownIsBlack) {
  DepthMap depth(100, 3);
  for (int y = 0; y < 3; ++y) {
    for (int x = 0; x < 100; ++x) depth(x, y) = 1 / (1 - 0.009f * float(x));
  }
  depth(50, 1) = 0;
  depth(51, 1) = std::numeric_limits<float>::quiet_NaN();
  Mask valid(100, 3, 255);
  valid(10, 2) = 0;
  const Image8 picture = DepthPicture(depth, valid);
  ASSERT_EQ(picture.width, 100);
  ASSERT_EQ(picture.height, 3);
  EXPECT_GT(picture(5, 0, 0), 2 * picture(5, 0, 2)) << "near: red";
  EXPECT_GT(picture(92, 0, 2), 2 * picture(92, 0, 0)) << "far: blue";
  for (int c = 0; c < 3; ++c) {
    EXPECT_EQ(picture(50, 1, c), 0);
    EXPECT_EQ(picture(51, 1, c), 0);
    EXPECT_EQ(picture(10, 2, c), picture(10, 0, c) / 2);
  }
  EXPECT_THAT(DepthPicture(DepthMap(4, 4, 0.0f)).data, ::testing::Each(0));
  EXPECT_NO_THROW(DepthPicture(DepthMap(4, 4, 2.0f)));
  EXPECT_THROW(DepthPicture(depth, Mask(3, 100)), OptionError);
}

}  // namespace
}  // namespace retint
