// SPDX-License-Identifier: BSD-3-Clause
#include "depth/stereo_pairs.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include "base/error.h"

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
ScalarImage Picture(const PixelRect& rect, const std::function<double(double, double)>& value) {
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
  // The reference's coordinate of what the shifted view shows at (u, v).
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
  PixelRect rect;
  ScalarImage reference, shifted;
};

Pair MakePair(Shift shift, const Plane& plane, unsigned seed) {
  const Texture texture(seed);
  const Camera camera = Camera::Pinhole(1, kWidth, kHeight, 200, 200, kWidth / 2, kHeight / 2);
  const PixelRect rect = PairRect(camera, shift, kPadding);
  return {rect, Picture(rect, texture), Picture(rect, [&](double u, double v) {
            const auto [x, y] = plane.Reference(shift, u, v);
            return texture(x, y);
          })};
}

ScalarImage Match(const Pair& pair, Shift shift, StereoMatcherKind kind) {
  DisparityRange range{0, kPadding};
  if (kind == StereoMatcherKind::kCensus) {
    EXPECT_TRUE(FitCensus(range));
    return MatchCensus(pair.reference, pair.rect, {shift, pair.rect, pair.shifted}, kWidth, kHeight,
                       range, 1);
  }
  return MatchPair(*MakeSgbmMatcher(),
                   {shift, pair.rect, ToBytes(pair.reference), ToBytes(pair.shifted)}, kWidth,
                   kHeight, range, 1);
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

class EveryShift : public ::testing::TestWithParam<Shift> {};
INSTANTIATE_TEST_SUITE_P(StereoPairs, EveryShift,
                         ::testing::Values(Shift::kRight, Shift::kLeft, Shift::kDown, Shift::kUp));

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
  for (const PixelRect side : {PixelRect{0, 0, 4, kHeight},
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

TEST_P(EveryShift, RefinementRemovesTheSubPixelError) {
  const Plane plane{14.3, 0.03, 0.04};
  const Shift shift = GetParam();
  const Pair pair = MakePair(shift, plane, 3);
  ScalarImage disparity = Picture({0, 0, kWidth, kHeight}, [&](double x, double y) {
    return std::round(2 * plane(x, y)) / 2;  // locked to half pixels
  });
  const double before = Compare(disparity, plane).median;
  const ScalarImage gray = Picture({0, 0, kWidth, kHeight}, Texture(3));
  const std::vector<ShiftedGray> shifted = {{shift, pair.rect, pair.shifted}};
  RefineDisparity(gray, shifted, disparity);
  const double after = Compare(disparity, plane).median;
  EXPECT_GT(before, 0.1);
  EXPECT_LT(after, 0.04);  // the damping leaves a share of the step
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

TEST(StereoPairs, RefinementLeavesHolesAndEdgesAlone) {
  const Plane plane{20, 0, 0};
  const Pair pair = MakePair(Shift::kRight, plane, 4);
  const std::vector<ShiftedGray> shifted = {{Shift::kRight, pair.rect, pair.shifted}};
  ScalarImage disparity(kWidth, kHeight, 20.2f);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 100; x < kWidth; ++x) disparity(x, y) = 9.9f;
  }
  disparity(40, 40) = -1;
  RefineDisparity(Picture({0, 0, kWidth, kHeight}, Texture(4)), shifted, disparity);
  EXPECT_EQ(disparity(40, 40), -1);
  EXPECT_EQ(disparity(41, 41), 20.2f);
  EXPECT_EQ(disparity(99, 80), 20.2f);
  EXPECT_EQ(disparity(100, 80), 9.9f);
  EXPECT_NEAR(disparity(60, 80), 20, 0.05);
}

// Answers with a constant whatever it is shown, another when it is asked the other way.
class FixedMatcher : public StereoMatcher {
 public:
  FixedMatcher(float forward, float backward) : forward_(forward), backward_(backward) {}
  StereoMatch Match(const Image8& left, const Image8&, const DisparityRange&) const override {
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
                     {0, kPadding}, 1);
  };
  EXPECT_EQ(match(10, 10.5f)(50, 50), 10);
  EXPECT_LT(match(10, 12)(50, 50), 0);
  EXPECT_LT(match(10, -1)(50, 50), 0);
  EXPECT_LT(match(-1, 10)(50, 50), 0);
}

TEST(StereoPairs, MatchersRefuseWhatIsNotAPair) {
  const auto matcher = MakeSgbmMatcher();
  EXPECT_THROW(matcher->Match(Image8(40, 30), Image8(41, 30), {0, 16}), OptionError);
  EXPECT_THROW(matcher->Match(Image8(40, 30), Image8(40, 30), {0, 20}), OptionError);
  EXPECT_THROW(matcher->Match(Image8(40, 30), Image8(40, 30), {-1, 16}), OptionError);
  // Narrower than the search range: nothing can be matched, and nothing breaks.
  const auto narrow = matcher->Match(Image8(12, 30), Image8(12, 30), {0, 16});
  EXPECT_TRUE(std::all_of(narrow.disparity.data.begin(), narrow.disparity.data.end(),
                          [](float s) { return s < 0; }));
}

TEST(Fuse, AveragesThoseThatAgreeAndTakesTheNearestWhereNoneDo) {
  const auto fuse = [](std::vector<float> values, StereoAggregate aggregate) {
    std::vector<ScalarImage> pairs;
    for (const float value : values) pairs.emplace_back(1, 1, value);
    return FuseDisparities(pairs, aggregate, 1).data[0];
  };
  constexpr auto kAgree = StereoAggregate::kAgree, kMin = StereoAggregate::kMin;
  EXPECT_FLOAT_EQ(fuse({20, 20.5f}, kAgree), 20.25f);
  EXPECT_FLOAT_EQ(fuse({20, 25}, kAgree), 25);  // the nearer: the larger disparity
  EXPECT_FLOAT_EQ(fuse({20, 25, 20.5f}, kAgree), 20.25f);
  EXPECT_FLOAT_EQ(fuse({30, 20, 20.4f, 30.2f}, kAgree), 30.1f);
  EXPECT_FLOAT_EQ(fuse({-1, 20}, kAgree), 20);
  EXPECT_LT(fuse({-1, -1}, kAgree), 0);
  EXPECT_FLOAT_EQ(fuse({20, 20.5f}, kMin), 20.5f);
  EXPECT_FLOAT_EQ(fuse({20, 25, 20.5f}, kMin), 25);
  EXPECT_LT(fuse({-1, -1}, kMin), 0);
}

// A near square of one texture before a far plane, seen from all four sides.
class Arbitration : public ::testing::Test {
 protected:
  static constexpr int kLeft = 70, kRight = 130, kTop = 50, kBottom = 110;
  static constexpr float kNear = 24, kFar = 10;
  static bool OnSquare(double x, double y) {
    return x >= kLeft && x < kRight && y >= kTop && y < kBottom;
  }
  // With `flat`, the far plane has no texture at all.
  void Render(bool flat) {
    const Texture near(11), far(12);
    const Camera camera = Camera::Pinhole(1, kWidth, kHeight, 200, 200, kWidth / 2, kHeight / 2);
    for (const Shift shift : {Shift::kRight, Shift::kLeft, Shift::kDown, Shift::kUp}) {
      const PixelRect rect = PairRect(camera, shift, kPadding);
      const double mx = shift == Shift::kRight ? -1 : shift == Shift::kLeft ? 1 : 0;
      const double my = shift == Shift::kDown ? -1 : shift == Shift::kUp ? 1 : 0;
      const auto look = [&](double amount) {
        return Picture(rect, [&, amount](double u, double v) {
          const double x = u - amount * mx * kNear, y = v - amount * my * kNear;
          if (OnSquare(x, y)) return near(x, y);
          return flat ? 0.5 : far(u - amount * mx * kFar, v - amount * my * kFar);
        });
      };
      pairs_.push_back({shift, rect, ToBytes(look(0)), ToBytes(look(1))});
    }
    truth_ = Picture({0, 0, kWidth, kHeight},
                     [](double x, double y) { return OnSquare(x, y) ? kNear : kFar; });
  }
  // The share of the pixels within 12 of the square whose disparity is right.
  double ShareRight(const ScalarImage& disparity) const {
    int right = 0, all = 0;
    for (int y = kTop - 12; y < kBottom + 12; ++y) {
      for (int x = kLeft - 12; x < kRight + 12; ++x) {
        ++all;
        right += std::abs(disparity(x, y) - truth_(x, y)) < 0.5;
      }
    }
    return double(right) / all;
  }
  // The truth with the square grown by 8 pixels, as a matcher's windows fatten it.
  ScalarImage Fattened() const {
    return Picture({0, 0, kWidth, kHeight}, [](double x, double y) {
      return x >= kLeft - 8 && x < kRight + 8 && y >= kTop - 8 && y < kBottom + 8 ? kNear : kFar;
    });
  }

  std::vector<RenderedPair> pairs_;
  ScalarImage truth_;
};

TEST_F(Arbitration, RoughDepthTrimsFattenedSilhouettesBeforeTexture) {
  Render(false);
  ScalarImage disparity = Fattened();
  EXPECT_LT(ShareRight(disparity), 0.7);
  const Mask measured = ArbitrateDisparity(pairs_, truth_, disparity);
  EXPECT_GT(ShareRight(disparity), 0.97);
  EXPECT_EQ(measured(kLeft - 5, 80), 255) << "colour confirms the rough depth there";
}

TEST_F(Arbitration, AndBeforeFlatColourByContinuity) {
  Render(true);
  ScalarImage disparity = Fattened();
  const Mask measured = ArbitrateDisparity(pairs_, truth_, disparity);
  EXPECT_GT(ShareRight(disparity), 0.97);
  EXPECT_EQ(measured(kLeft - 5, 80), 0) << "nothing was measured there";
  EXPECT_EQ(measured(100, 80), 255);
}

TEST_F(Arbitration, WrongRoughDepthDoesNotSpoilStereo) {
  Render(false);
  ScalarImage rough = truth_;
  for (int y = 60; y < 100; ++y) {
    for (int x = 10; x < 50; ++x) rough(x, y) = 4;    // a blob behind the far plane
    for (int x = 80; x < 120; ++x) rough(x, y) = 10;  // a hole in the square
  }
  ScalarImage disparity = truth_;
  const Mask measured = ArbitrateDisparity(pairs_, rough, disparity);
  EXPECT_EQ(disparity.data, truth_.data);
  EXPECT_EQ(measured(30, 80), 255);
}

TEST_F(Arbitration, AgreeingDepthsAreAveragedAndUnknownOnesStayUnknown) {
  Render(false);
  ScalarImage rough = truth_, disparity = truth_;
  rough(20, 20) = kFar + 0.5f;
  rough(21, 20) = -1;
  disparity(160, 20) = rough(160, 20) = -1;
  const Mask measured = ArbitrateDisparity(pairs_, rough, disparity);
  EXPECT_FLOAT_EQ(disparity(20, 20), kFar + 0.25f);
  EXPECT_EQ(disparity(21, 20), kFar);
  EXPECT_EQ(measured(21, 20), 255);
  EXPECT_EQ(disparity(160, 20), -1);
  EXPECT_EQ(measured(160, 20), 0);
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
