// SPDX-License-Identifier: BSD-3-Clause
#include "depth/stereo_pairs.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <span>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include "base/error.h"
#include "kernels/backend.h"

namespace retint {
namespace {

constexpr int kWidth = 200, kHeight = 160, kPadding = 48;

// Smooth noise in [0, 1], the same at any real position: a texture to look at from two places.
class Texture {
 public:
  explicit Texture(unsigned seed) : values_(64 * 64) {
    std::mt19937 random(seed);
    for (float& value : values_) value = float(random() % 1000) / 999.0f;
  }
  double operator()(double x, double y) const {
    return 0.6 * Octave(x / 5.0, y / 5.0) + 0.4 * Octave(x / 11.0 + 7, y / 11.0 + 3);
  }

 private:
  double At(int x, int y) const { return values_[size_t((y & 63) * 64 + (x & 63))]; }
  double Octave(double x, double y) const {
    const int x0 = int(std::floor(x)), y0 = int(std::floor(y));
    const auto fade = [](double t) { return t * t * (3 - 2 * t); };
    const double u = fade(x - x0), v = fade(y - y0);
    return (At(x0, y0) * (1 - u) + At(x0 + 1, y0) * u) * (1 - v) +
           (At(x0, y0 + 1) * (1 - u) + At(x0 + 1, y0 + 1) * u) * v;
  }
  std::vector<float> values_;
};

// A picture of `value(x, y)` at the pixel centres of `rect`.
ScalarImage Picture(const GridRect& rect, const std::function<double(double, double)>& value) {
  ScalarImage image(rect.width, rect.height);
  for (int y = 0; y < rect.height; ++y) {
    for (int x = 0; x < rect.width; ++x) {
      image(x, y) = float(value(rect.x + x + 0.5, rect.y + y + 0.5));
    }
  }
  return image;
}

Image8 ToBytes(const ScalarImage& gray) {
  Image8 out(gray.width, gray.height);
  for (size_t i = 0; i < gray.data.size(); ++i) {
    std::fill_n(&out.data[3 * i], 3, uint8_t(std::lround(gray.data[i] * 255)));
  }
  return out;
}

// A plane of disparity s(x, y) = base + slope_x x + slope_y y over the reference's pixels.
struct Plane {
  double base, slope_x, slope_y;
  double operator()(double x, double y) const { return base + slope_x * x + slope_y * y; }
  // The reference's coordinate of the point at (u, v) in the shifted view.
  std::pair<double, double> Reference(Shift shift, double u, double v) const {
    switch (shift) {
      case Shift::kRight:  // u = x - s
        return {(u + base + slope_y * v) / (1 - slope_x), v};
      case Shift::kLeft:  // u = x + s
        return {(u - base - slope_y * v) / (1 + slope_x), v};
      case Shift::kDown:
        return {u, (v + base + slope_x * u) / (1 - slope_y)};
      case Shift::kUp:
        return {u, (v - base - slope_x * u) / (1 + slope_y)};
    }
    return {};
  }
};

struct Pair {
  GridRect rect;
  ScalarImage reference, shifted;
};

Pair MakePair(Shift shift, const Plane& plane, unsigned seed) {
  const Texture texture(seed);
  const Camera camera = Camera::Pinhole(1, kWidth, kHeight, 200, 200, kWidth / 2, kHeight / 2);
  const GridRect rect = PairRect(camera, shift, kPadding);
  return {rect, Picture(rect, texture), Picture(rect, [&](double u, double v) {
            const auto [x, y] = plane.Reference(shift, u, v);
            return texture(x, y);
          })};
}

ScalarImage Match(const Pair& pair, Shift shift, StereoMatcherKind kind) {
  DisparityRange range{0, kPadding};
  if (kind == StereoMatcherKind::kCensus) {
    EXPECT_TRUE(FitCensus(range));
    const auto backend = CreateBackend("cpu");
    const auto upload = [&](const ScalarImage& image) {
      return backend->Upload(std::span<const float>(image.data));
    };
    const auto reference = upload(pair.reference), shifted = upload(pair.shifted);
    const GridRect& rect = pair.rect;
    const Motion motion = MotionOf(shift);
    ScalarImage disparity(kWidth, kHeight);
    const auto found = backend->Allocate<float>(disparity.data.size());
    backend->stereo().Match(
        {.reference = {nullptr, reference.data(), rect.x, rect.y, rect.width, rect.height, 0, 0},
         .shifted = {nullptr, shifted.data(), rect.x, rect.y, rect.width, rect.height, motion.x,
                     motion.y},
         .width = kWidth,
         .height = kHeight,
         .lowest = range.lowest,
         .count = range.count,
         .tolerance = 1,
         .disparity = found.data()});
    disparity.data = backend->Download(found.data(), found.size());
    return disparity;
  }
  return MatchPair(*MakeSgbmMatcher(),
                   {shift, pair.rect, ToBytes(pair.reference), ToBytes(pair.shifted)}, kWidth,
                   kHeight, range, 1, Monitor());
}

struct Errors {
  double median = 0, bias = 0, found = 0;
};

Errors Compare(const ScalarImage& disparity, const Plane& plane) {
  std::vector<double> errors;
  double sum = 0;
  for (int y = 0; y < disparity.height; ++y) {
    for (int x = 0; x < disparity.width; ++x) {
      if (disparity(x, y) <= 0) continue;
      const double error = disparity(x, y) - plane(x + 0.5, y + 0.5);
      errors.push_back(std::abs(error));
      sum += error;
    }
  }
  if (errors.empty()) return {};
  std::nth_element(errors.begin(), errors.begin() + std::ptrdiff_t(errors.size() / 2),
                   errors.end());
  return {errors[errors.size() / 2], sum / double(errors.size()),
          double(errors.size()) / double(disparity.NumPixels())};
}

class EveryMatcher : public ::testing::TestWithParam<std::tuple<Shift, StereoMatcherKind>> {};
INSTANTIATE_TEST_SUITE_P(
    StereoPairs, EveryMatcher,
    ::testing::Combine(::testing::Values(Shift::kRight, Shift::kLeft, Shift::kDown, Shift::kUp),
                       ::testing::Values(StereoMatcherKind::kCensus, StereoMatcherKind::kSgbm)));

TEST_P(EveryMatcher, MatchesAConstantDisparityUpToTheBorders) {
  const auto [shift, kind] = GetParam();
  const Plane plane{20, 0, 0};
  const Pair pair = MakePair(shift, plane, 1);
  const ScalarImage disparity = Match(pair, shift, kind);
  ASSERT_EQ(disparity.width, kWidth);
  ASSERT_EQ(disparity.height, kHeight);
  const Errors errors = Compare(disparity, plane);
  EXPECT_GT(errors.found, 0.98);
  // SGBM's resolution; the census' costs are steps, of which a parabola makes more.
  EXPECT_LT(errors.median, kind == StereoMatcherKind::kSgbm ? 1.0 / 16 + 1e-6 : 0.12);
  // No border is lost: each of its four sides is as complete as the whole.
  for (const GridRect side : {GridRect{0, 0, 4, kHeight},
                              {kWidth - 4, 0, 4, kHeight},
                              {0, 0, kWidth, 4},
                              {0, kHeight - 4, kWidth, 4}}) {
    int found = 0;
    for (int y = side.y; y < side.y + side.height; ++y) {
      for (int x = side.x; x < side.x + side.width; ++x) {
        found += std::abs(disparity(x, y) - 20) < 0.5;
      }
    }
    EXPECT_GT(found, 0.9 * side.width * side.height) << side.x << "," << side.y;
  }
}

TEST_P(EveryMatcher, MatchesASlantedPlane) {
  const auto [shift, kind] = GetParam();
  const Plane plane{14, 0.04, 0.05};
  const Pair pair = MakePair(shift, plane, 2);
  const ScalarImage disparity = Match(pair, shift, kind);
  const Errors errors = Compare(disparity, plane);
  EXPECT_GT(errors.found, 0.95);
  EXPECT_LT(errors.median, 0.25);  // both lock towards whole pixels on slopes
}

TEST(StereoPairs, CensusTakesRangesOfWholeSteps) {
  DisparityRange range{3, 16};
  EXPECT_TRUE(FitCensus(range));
  EXPECT_EQ(range.lowest, 3);
  EXPECT_EQ(range.count, 32);
  range.count = 240;
  EXPECT_TRUE(FitCensus(range));
  EXPECT_EQ(range.count, 256);
  range.count = 272;
  EXPECT_FALSE(FitCensus(range));
  EXPECT_EQ(range.count, 272);
}

// Answers with a constant whatever it is shown, another when it is asked the other way.
class FixedMatcher : public StereoMatcher {
 public:
  FixedMatcher(float forward, float backward) : forward_(forward), backward_(backward) {}
  StereoMatch Match(const Image8& left, const Image8&, const DisparityRange&,
                    const Monitor&) const override {
    const bool padded = left.width > kWidth;  // as the mirrored pair is
    return {ScalarImage(left.width, left.height, padded ? backward_ : forward_)};
  }

 private:
  float forward_, backward_;
};

TEST(StereoPairs, LeftRightCheckDropsWhatTheOtherWayDenies) {
  const Image8 image(kWidth, kHeight);
  const auto match = [&](float forward, float backward) {
    return MatchPair(FixedMatcher(forward, backward),
                     {Shift::kRight, {0, 0, kWidth, kHeight}, image, image}, kWidth, kHeight,
                     {0, kPadding}, 1, Monitor());
  };
  EXPECT_EQ(match(10, 10.5f)(50, 50), 10);
  EXPECT_LT(match(10, 12)(50, 50), 0);
  EXPECT_LT(match(10, -1)(50, 50), 0);
  EXPECT_LT(match(-1, 10)(50, 50), 0);
}

TEST(StereoPairs, MatchersRefuseWhatIsNotAPair) {
  const auto matcher = MakeSgbmMatcher();
  const Monitor monitor;
  EXPECT_THROW(matcher->Match(Image8(40, 30), Image8(41, 30), {0, 16}, monitor), OptionError);
  EXPECT_THROW(matcher->Match(Image8(40, 30), Image8(40, 30), {0, 20}, monitor), OptionError);
  EXPECT_THROW(matcher->Match(Image8(40, 30), Image8(40, 30), {-1, 16}, monitor), OptionError);
  // Narrower than the search range: nothing can be matched, and nothing breaks.
  const auto narrow = matcher->Match(Image8(12, 30), Image8(12, 30), {0, 16}, monitor);
  EXPECT_TRUE(std::all_of(narrow.disparity.data.begin(), narrow.disparity.data.end(),
                          [](float s) { return s < 0; }));
}

TEST(StereoPairs, ShiftedCamerasSeeTheDisparityThatTheNameSays) {
  // fx and fy differ: both directions must give s = fx beta / z.
  const PosedCamera view{Camera::Pinhole(1, 100, 80, 90, 120, 50, 40),
                         {Eigen::Quaterniond(0.9, 0.1, -0.2, 0.3).normalized(), {0.1, 0.2, 0.3}}};
  const Eigen::Vector3d point = view.Unproject({60, 30}, 3);
  const double beta = 0.2, s = 90 * beta / 3;
  const std::pair<Shift, Eigen::Vector2d> expected[] = {{Shift::kRight, {60 - s, 30}},
                                                        {Shift::kLeft, {60 + s, 30}},
                                                        {Shift::kDown, {60, 30 - s}},
                                                        {Shift::kUp, {60, 30 + s}}};
  for (const auto& [shift, pixel] : expected) {
    const auto seen = ShiftCamera(view, shift, beta).Project(point);
    ASSERT_TRUE(seen.has_value());
    EXPECT_NEAR(seen->x(), pixel.x(), 1e-9);
    EXPECT_NEAR(seen->y(), pixel.y(), 1e-9);
    EXPECT_NEAR(seen->z(), 3, 1e-9);
  }
  const auto cropped = CropCamera(view, {-7, 5, 114, 60}).Project(point);
  EXPECT_NEAR(cropped->x(), 67, 1e-9);
  EXPECT_NEAR(cropped->y(), 25, 1e-9);
}

}  // namespace
}  // namespace retint
