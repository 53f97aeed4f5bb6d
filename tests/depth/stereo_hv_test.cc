// SPDX-License-Identifier: BSD-3-Clause
#include "depth/stereo_hv.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "tests/depth/plane_scene.h"

namespace retint {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

PosedCamera View() { return {Camera::Pinhole(1, 240, 180, 200, 210, 118.5, 93.25), Rigid3d{}}; }

// Finds the same disparity everywhere, both ways, or nothing when it is negative.
class FixedMatcher : public StereoMatcher {
 public:
  explicit FixedMatcher(float disparity) : disparity_(disparity) {}
  StereoMatch Match(const Image8& left, const Image8&, const DisparityRange&,
                    const Monitor&) const override {
    return {ScalarImage(left.width, left.height, disparity_)};
  }

 private:
  float disparity_;
};

double MedianRelativeError(const DepthEstimate& estimate, const DepthMap& truth) {
  std::vector<double> errors;
  for (size_t i = 0; i < truth.data.size(); ++i) {
    if (estimate.valid.data[i]) {
      errors.push_back(std::abs(estimate.depth.data[i] / truth.data[i] - 1));
    }
  }
  if (errors.empty()) return 1;
  const auto middle = errors.begin() + std::ptrdiff_t(errors.size() / 2);
  std::nth_element(errors.begin(), middle, errors.end());
  return *middle;
}

TEST(ChooseStereoSearch, PutsTheMedianWhereItIsAsked) {
  const Camera camera = Camera::Pinhole(1, 400, 300, 350, 350, 200, 150);
  const StereoSearch search = ChooseStereoSearch(camera, {5, 5, 5}, {});
  const double s = 350 * search.baseline / 5;
  EXPECT_NEAR(s, 0.05 * 400, 1e-6);
  EXPECT_LT(search.range.lowest, s);
  EXPECT_GT(search.range.lowest + search.range.count, s);
  EXPECT_EQ(search.range.count % 16, 0);
  EXPECT_LE(search.range.count, 32) << "a scene of one depth needs a short search";
}

TEST(ChooseStereoSearch, KeepsTheNearestInRange) {
  const Camera camera = Camera::Pinhole(1, 1600, 900, 1400, 1400, 800, 450);
  const RoughDepths rough{2, 20, 20};
  const StereoSearch search = ChooseStereoSearch(camera, rough, {});
  const double nearest = 1400 * search.baseline / 2;
  EXPECT_LT(nearest, search.range.lowest + search.range.count);
  EXPECT_LE(search.range.count, 128);
  EXPECT_LT(1400 * search.baseline / 20, 0.05 * 1600) << "so the baseline had to shrink";

  StereoHvOptions given;
  given.baseline = 1;
  EXPECT_EQ(ChooseStereoSearch(camera, rough, given).baseline, 1) << "a given one is kept";
}

// Skipped without a device.
std::shared_ptr<Backend> BackendOrNull(const std::string& name) {
  try {
    return CreateBackend(name);
  } catch (const std::exception&) {
    EXPECT_EQ(name, "cuda");
    return nullptr;
  }
}

// By backend. Skipped without a device.
class OnPlanes
    : public ::testing::TestWithParam<std::tuple<std::pair<double, double>, const char*>> {};
INSTANTIATE_TEST_SUITE_P(
    StereoHv, OnPlanes,
    ::testing::Combine(::testing::Values(std::pair{0.0, 0.0}, std::pair{0.5, 0.0},
                                         std::pair{0.0, -0.5}, std::pair{-0.3, 0.4}),
                       ::testing::Values("cpu", "cuda")));

TEST_P(OnPlanes, MeasuresThemToAFewTenthsOfAPercent) {
  const auto& [slopes, backend_name] = GetParam();
  const auto backend = BackendOrNull(backend_name);
  if (!backend) GTEST_SKIP() << CudaFault();
  const PlaneScene plane{4, slopes.first, slopes.second};
  Renderer renderer(backend, plane.Model(4.5, 0.06, 1));
  Monitor monitor;
  const auto estimate = StereoHvEstimator(renderer).Estimate(View(), monitor);
  EXPECT_EQ(estimate.method, "stereo-hv");
  EXPECT_THAT(estimate.reason, HasSubstr("4 rendered pairs"));
  EXPECT_GT(estimate.valid_fraction, 0.97);
  const DepthMap truth = plane.ExactDepth(View().camera);
  // Disparities are about 12 pixels: 0.3 % is 0.04 of a pixel.
  EXPECT_LT(MedianRelativeError(estimate, truth), 0.003);
  // To the very borders, which plain stereo loses.
  for (int y = 2; y < 180; y += 25) {
    for (const int x : {1, 238})
      EXPECT_NEAR(estimate.depth(x, y), truth(x, y), 0.06) << x << "," << y;
  }
}

class OnBackends : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(StereoHv, OnBackends, ::testing::Values("cpu", "cuda"));

TEST_P(OnBackends, MeasuresThePartThatIsAskedFor) {
  const auto backend = BackendOrNull(GetParam());
  if (!backend) GTEST_SKIP() << CudaFault();
  const PlaneScene plane{4, 0.2, 0.1};
  const DepthMap truth = plane.ExactDepth(View().camera);
  Renderer renderer(backend, plane.Model(4.5, 0.06, 2));
  Monitor monitor;
  const GridRect part{61, 40, 100, 90};
  const auto estimate = StereoHvEstimator(renderer).EstimatePart(View(), part, monitor);
  ASSERT_EQ(estimate.depth.NumPixels(), truth.NumPixels());
  ASSERT_EQ(estimate.valid.NumPixels(), truth.NumPixels());
  EXPECT_GT(estimate.valid_fraction, 0.97);
  EXPECT_LT(MedianRelativeError(estimate, truth), 0.003);
  for (int y = 0; y < truth.height; ++y) {
    for (int x = 0; x < truth.width; ++x) {
      EXPECT_NEAR(estimate.depth(x, y), truth(x, y), 0.5) << x << "," << y;
      const bool inside = x >= 61 && x < 161 && y >= 40 && y < 130;
      if (inside) continue;
      ASSERT_EQ(estimate.valid(x, y), 0) << x << "," << y;
    }
  }
}

TEST_P(OnBackends, ThePapersTwoPairsAndMinimumWorkToo) {
  const auto backend = BackendOrNull(GetParam());
  if (!backend) GTEST_SKIP() << CudaFault();
  const PlaneScene plane{4, 0.2, 0.1};
  const DepthMap truth = plane.ExactDepth(View().camera);
  Renderer renderer(backend, plane.Model(4.5, 0.06, 2));
  StereoHvOptions options;
  options.both_sides = false;
  options.aggregate = StereoAggregate::kMin;
  options.arbitrate = false;
  options.subpixel = false;
  Monitor monitor;
  const auto papers = StereoHvEstimator(renderer, options).Estimate(View(), monitor);
  EXPECT_THAT(papers.reason, HasSubstr("2 rendered pairs"));
  EXPECT_GT(papers.valid_fraction, 0.95);
  // No sub-pixel refinement, and the minimum is biased to the near side.
  EXPECT_LT(MedianRelativeError(papers, truth), 0.015);
  const auto full = StereoHvEstimator(renderer).Estimate(View(), monitor);
  EXPECT_THAT(full.reason, HasSubstr("4 rendered pairs"));
  EXPECT_LT(MedianRelativeError(full, truth), MedianRelativeError(papers, truth));
}

TEST(StereoHv, OpenCvsMatcherIsAChoice) {
  const PlaneScene plane{4, 0.2, 0.1};
  Renderer renderer(CreateBackend("cpu"), plane.Model(4.5, 0.06, 2));
  StereoHvOptions options;
  options.matcher = StereoMatcherKind::kSgbm;
  Monitor monitor;
  const auto sgbm = StereoHvEstimator(renderer, options).Estimate(View(), monitor);
  EXPECT_GT(sgbm.valid_fraction, 0.97);
  EXPECT_LT(MedianRelativeError(sgbm, plane.ExactDepth(View().camera)), 0.003);
  const auto census = StereoHvEstimator(renderer).Estimate(View(), monitor);
  EXPECT_NE(sgbm.depth.data, census.depth.data) << "or it was not another matcher";
}

// A plane so steep, and a baseline so long, that disparities of 100 to 300 pixels are searched.
// That is too much for census, so OpenCV's matcher replaces it.
TEST_P(OnBackends, SearchesTooLongForCensusAreLeftToOpenCvWithAWarning) {
  const auto backend = BackendOrNull(GetParam());
  if (!backend) GTEST_SKIP() << CudaFault();
  const PosedCamera view{Camera::Pinhole(1, 640, 80, 320, 320, 320, 40), Rigid3d{}};
  const PlaneScene plane{4, 0.5, 0};
  Renderer renderer(backend, plane.Model(9, 0.08, 4));
  StereoHvOptions options;
  options.baseline = 2.4;
  options.max_disparities = 288;
  Monitor monitor;
  const auto census = StereoHvEstimator(renderer, options).Estimate(view, monitor);
  EXPECT_THAT(census.warning, HasSubstr("too long for the census matcher"));
  EXPECT_THAT(census.reason, HasSubstr("StereoSGBM matched the pairs instead"));
  EXPECT_GT(census.valid_fraction, 0.3) << "or nothing was matched";
  options.matcher = StereoMatcherKind::kSgbm;
  const auto sgbm = StereoHvEstimator(renderer, options).Estimate(view, monitor);
  EXPECT_EQ(census.depth.data, sgbm.depth.data);
  EXPECT_EQ(sgbm.warning, "") << "it was asked for";
  options.matcher = StereoMatcherKind::kCensus;
  options.max_disparities = 256;
  const auto shorter = StereoHvEstimator(renderer, options).Estimate(view, monitor);
  EXPECT_EQ(shorter.warning, "");
  EXPECT_THAT(shorter.reason, Not(HasSubstr("StereoSGBM")));
  EXPECT_NE(shorter.depth.data, sgbm.depth.data) << "or census was not used where it can be";
}

// A baseline that moves all of a wide view by more than two thousand pixels.
TEST(StereoHv, DisparitiesThatOpenCvCannotHoldAreAWarning) {
  const PosedCamera view{Camera::Pinhole(1, 3200, 16, 1600, 1600, 1600, 8), Rigid3d{}};
  const PlaneScene plane{4, 0, 0};
  Renderer renderer(CreateBackend("cpu"), plane.Model(5, 0.08, 4));
  StereoHvOptions options;
  options.both_sides = false;
  options.max_disparities = 64;
  Monitor monitor;
  for (const auto matcher : {StereoMatcherKind::kCensus, StereoMatcherKind::kSgbm}) {
    options.matcher = matcher;
    options.baseline = 7;  // 2800 pixels, of which 2096 and more are searched
    const bool is_census = matcher == StereoMatcherKind::kCensus;
    const auto far = StereoHvEstimator(renderer, options).Estimate(view, monitor);
    EXPECT_EQ(far.warning.find("finds those up to 2047") == std::string::npos, is_census);
    options.baseline = 5;
    EXPECT_EQ(StereoHvEstimator(renderer, options).Estimate(view, monitor).warning, "");
  }
}

TEST(StereoHv, DisparityBecomesDepthByTheBaseline) {
  const PlaneScene plane{4, 0, 0};
  Renderer renderer(CreateBackend("cpu"), plane.Model(4.5, 0.06, 3));
  StereoHvOptions options;
  options.baseline = 0.25;
  options.arbitrate = false;
  options.subpixel = false;
  Monitor monitor;
  StereoHvEstimator stereo(renderer, options, std::make_unique<FixedMatcher>(10.0f));
  const auto estimate = stereo.Estimate(View(), monitor);
  EXPECT_FLOAT_EQ(estimate.depth(120, 90), 200 * 0.25f / 10);  // fx beta / s
  EXPECT_EQ(estimate.valid(120, 90), 255);
}

// A plane at depth 4, a focal length of 200 pixels, a width of 240. A baseline of 4.8 moves it by
// the width, one of 0.00125 by 1/16 pixel.
TEST(StereoHv, RefusesBaselinesThatMoveEverythingOutOfTheImage) {
  const PlaneScene plane{4, 0, 0};
  Renderer renderer(CreateBackend("cpu"), plane.Model(4.5, 0.06, 3));
  Monitor monitor;
  StereoHvOptions options;
  for (const double baseline : {5.5, 1000.0, 1e300}) {
    options.baseline = baseline;
    StereoHvEstimator stereo(renderer, options);
    const auto says_the_range = ::testing::ThrowsMessage<OptionError>(::testing::AllOf(
        HasSubstr("more than its width"), HasSubstr(" to 4.8"), HasSubstr("or 0")));
    EXPECT_THAT([&] { stereo.Estimate(View(), monitor); }, says_the_range) << baseline;
    EXPECT_THAT([&] { stereo.Cameras(View(), monitor); }, says_the_range) << baseline;
  }
  // Of a part, whose own surfaces count, the limit is the whole image's width too.
  options.baseline = 4.5;
  EXPECT_NO_THROW(
      StereoHvEstimator(renderer, options).EstimatePart(View(), {100, 80, 40, 30}, monitor));
}

TEST(StereoHv, WarnsOfBaselinesThatMoveNothing) {
  const PlaneScene plane{4, 0, 0};
  Renderer renderer(CreateBackend("cpu"), plane.Model(4.5, 0.06, 3));
  Monitor monitor;
  StereoHvOptions options;
  options.baseline = 1e-9;
  const auto still = StereoHvEstimator(renderer, options).Estimate(View(), monitor);
  EXPECT_THAT(still.warning, HasSubstr("nothing is measured: take one from 0.0012"));
  EXPECT_THAT(still.reason, HasSubstr(still.warning));
  options.baseline = 0.25;
  EXPECT_EQ(StereoHvEstimator(renderer, options).Estimate(View(), monitor).warning, "");
}

TEST(StereoHv, FallsBackToTheGaussiansWhereNothingMatches) {
  const PlaneScene plane{4, 0, 0};
  Renderer renderer(CreateBackend("cpu"), plane.Model(4.5, 0.06, 4));
  Monitor monitor;
  StereoHvEstimator stereo(renderer, {}, std::make_unique<FixedMatcher>(-1.0f));
  const auto estimate = stereo.Estimate(View(), monitor);
  EXPECT_EQ(estimate.valid_fraction, 0);
  EXPECT_THAT(estimate.valid.data, ::testing::Each(0));
  EXPECT_NEAR(estimate.depth(120, 90), 4, 0.02);
  EXPECT_THAT(estimate.reason, HasSubstr("0.0 %"));
}

TEST(StereoHv, StopsWhenCancelled) {
  const PlaneScene plane{4, 0, 0};
  Renderer renderer(CreateBackend("cpu"), plane.Model(4.5, 0.06, 5));
  StereoHvEstimator stereo(renderer);
  Monitor before;
  before.Cancel();
  EXPECT_THROW(stereo.Estimate(View(), before), Cancelled);

  Monitor* stop = nullptr;
  double last = 0;
  Monitor during([&](const Progress& progress) {
    EXPECT_EQ(progress.stage, "depth");
    EXPECT_GE(progress.fraction, last);
    last = progress.fraction;
    if (progress.fraction > 0.3) stop->Cancel();
  });
  stop = &during;
  EXPECT_THROW(stereo.Estimate(View(), during), Cancelled);
  EXPECT_LT(last, 1);
}

TEST(StereoHv, RefusesBadOptionsAndBadViews) {
  const auto refused = [](auto change) {
    StereoHvOptions options;
    change(options);
    EXPECT_THROW(options.Check(), OptionError);
  };
  refused([](auto& o) { o.baseline = -1; });
  refused([](auto& o) { o.baseline = std::nan(""); });
  refused([](auto& o) { o.median_disparity = 0; });
  refused([](auto& o) { o.max_disparities = 100; });
  refused([](auto& o) { o.max_disparities = 0; });
  refused([](auto& o) { o.left_right_tolerance = -1; });
  refused([](auto& o) { o.agree_tolerance = -0.5; });
  refused([](auto& o) { o.sgbm.block_size = 4; });
  refused([](auto& o) { o.sgbm.jump = o.sgbm.smoothness; });
  EXPECT_NO_THROW(StereoHvOptions{}.Check());

  Renderer renderer(CreateBackend("cpu"), PlaneScene{}.Model(1, 0.2, 6));
  Monitor monitor;
  PosedCamera away = View();
  away.cam_from_world.translation.z() = -100;
  EXPECT_THROW(StereoHvEstimator(renderer).Estimate(away, monitor), InputError);
  PosedCamera distorted = View();
  distorted.camera.model = CameraModelId::kSimpleRadial;
  distorted.camera.params = {200, 120, 90, 0.1};
  EXPECT_THROW(StereoHvEstimator(renderer).Estimate(distorted, monitor), InputError);
}

}  // namespace
}  // namespace retint
