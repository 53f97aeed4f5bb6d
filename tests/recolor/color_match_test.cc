// SPDX-License-Identifier: BSD-3-Clause
#include "recolor/color_match.h"

#include <cmath>
#include <functional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "kernels/common/color_spaces.h"
#include "tests/recolor/tiny_scene.h"

namespace retint {
namespace {

using Eigen::Vector3d;
using Map = std::function<Vector3d(const Vector3d&, size_t view)>;

Vector3d InLight(const Vector3d& color, const std::function<Vector3d(const Vector3d&)>& map) {
  Vector3d light;
  for (int c = 0; c < 3; ++c) light[c] = double(LinearFromSrgb(float(color[c])));
  light = map(light);
  for (int c = 0; c < 3; ++c) light[c] = double(SrgbFromLinear(float(light[c])));
  return light;
}

// Eight views of random colors, noise of half a step of eight bits, every fourth held out; of the
// pairs `wrong` have nothing to do with the map.
std::vector<MatchView> ViewsOf(const Map& map, double wrong = 0) {
  TestRandom random(7);
  std::vector<MatchView> views;
  for (size_t v = 0; v < 8; ++v) {
    MatchView view{"view" + std::to_string(v), v % 4 == 0, {}, {}};
    for (int i = 0; i < 1500; ++i) {
      const double gray = random.Uniform(0.08, 0.75);
      const Vector3d from(gray + random.Uniform(-0.08, 0.15), gray + random.Uniform(-0.08, 0.15),
                          gray + random.Uniform(-0.08, 0.15));
      Vector3d to = map(from, v);
      if (random.Uniform(0, 1) < wrong) to = Vector3d(0.8, random.Uniform(0, 1), 0.1);
      for (int c = 0; c < 3; ++c) {
        view.from.push_back(float(from[c] + random.Uniform(-0.002, 0.002)));
        view.to.push_back(float(to[c] + random.Uniform(-0.002, 0.002)));
      }
    }
    views.push_back(std::move(view));
  }
  return views;
}

TEST(ColorMatch, ChoosesThePlainestMapThatSuffices) {
  const auto chosen = [](const Map& map) { return MatchColors(ViewsOf(map), {}).map; };
  EXPECT_EQ(chosen([](const Vector3d& c, size_t) { return c; }), MatchMap::kNone);
  EXPECT_EQ(chosen([](const Vector3d& c, size_t) {
              return InLight(c, [](const Vector3d& light) { return Vector3d(1.3 * light); });
            }),
            MatchMap::kExposure);
  EXPECT_EQ(chosen([](const Vector3d& c, size_t) {
              return InLight(c, [](const Vector3d& light) {
                return Vector3d(light.cwiseProduct(Vector3d(1.3, 1.2, 1)));
              });
            }),
            MatchMap::kBalance);
  EXPECT_EQ(chosen([](const Vector3d& c, size_t) {
              return Vector3d(0.7 * c + Vector3d::Constant(0.3 * c.sum() / 3));
            }),
            MatchMap::kMatrix);
  EXPECT_EQ(chosen([](const Vector3d& c, size_t) { return Vector3d(c.array().max(0).pow(1.3)); }),
            MatchMap::kTable);
  // A slight curve: a table would be better by 0.1 DeltaE00, which is not worth a fit.
  EXPECT_EQ(chosen([](const Vector3d& c, size_t) { return Vector3d(c.array().max(0).pow(1.05)); }),
            MatchMap::kMatrix);
}

TEST(ColorMatch, PairsThatContradictMostDoNotCount) {
  const auto views = ViewsOf(
      [](const Vector3d& c, size_t) {
        return InLight(c, [](const Vector3d& light) { return Vector3d(std::exp2(-0.3) * light); });
      },
      /*wrong=*/0.25);
  const ColorMatch match = MatchColors(views, {.map = MatchMap::kExposure, .reference = {}});
  EXPECT_NEAR(match.gray_stops.mean(), -0.3, 0.01);  // of 0.004 by the noise
  EXPECT_FALSE(match.exposures_differ);
}

TEST(ColorMatch, ExposuresOfTheViewsAreNoDrift) {
  const double stops[] = {0.3, -0.2, 0.45, -0.4,
                          0.1, 0,    -0.1, 0.2};  // of those fitted, 0 in the middle
  const auto views = ViewsOf([&](const Vector3d& c, size_t v) {
    return InLight(
        c, [&](const Vector3d& light) { return Vector3d(std::exp2(0.5 + stops[v]) * light); });
  });
  const ColorMatch match = MatchColors(views, {});
  EXPECT_TRUE(match.exposures_differ);
  EXPECT_EQ(match.map, MatchMap::kExposure);
  // The median of the fitted views 1, 2, 3, 5, 6 and 7 lies between -0.1 and 0.
  EXPECT_NEAR(match.gray_stops.mean(), 0.5 - 0.05, 0.01);
  for (size_t v = 0; v < 8; ++v) {
    EXPECT_NEAR(match.views[v].stops.mean(), stops[v] + 0.05, 0.01) << v;
  }
  EXPECT_LT(match.after, 0.3);  // the noise
  const auto sentences = SentencesOf(match, "the photos");
  ASSERT_EQ(sentences.size(), 2u);
  EXPECT_THAT(sentences[1], testing::HasSubstr("a different exposure each"));
  // By the exposure of one of them.
  const ColorMatch by_view = MatchColors(
      views, {.map = {}, .reference = MatchReference{"view2", Eigen::Matrix3d::Identity()}});
  EXPECT_NEAR(by_view.gray_stops.mean(), 0.95, 0.01);
}

TEST(ColorMatch, ACheckerIsMadeRight) {
  const std::span<const float> truth = CheckerColors();
  ASSERT_EQ(truth.size(), 72u);
  Eigen::Matrix3d mix;
  mix << 0.7, 0.2, 0, 0.1, 0.6, 0.1, 0, 0.05, 0.8;
  std::vector<float> shown;
  for (size_t i = 0; i < 24; ++i) {
    const Vector3d color(double(truth[3 * i]), double(truth[3 * i + 1]), double(truth[3 * i + 2]));
    const Vector3d mixed = InLight(color, [&](const Vector3d& l) { return Vector3d(mix * l); });
    for (int c = 0; c < 3; ++c) shown.push_back(float(mixed[c]));
  }
  const auto fit = FitChecker(shown);
  ASSERT_TRUE(fit);
  EXPECT_GT(fit->before, 3);
  EXPECT_LT(fit->after, 0.05);  // rounding
  EXPECT_LT((fit->correction * mix - Eigen::Matrix3d::Identity()).norm(), 0.01);
  EXPECT_FALSE(FitChecker(std::vector<float>(72, 0.99F)));  // clipped
}

TEST(ColorMatch, OneViewIsTooFew) {
  const auto views = ViewsOf([](const Vector3d& c, size_t) { return c; });
  EXPECT_THROW(MatchColors(std::span(views).first(1), {}), InputError);
  const MatchReference unknown{"elsewhere", Eigen::Matrix3d::Identity()};
  EXPECT_THROW(MatchColors(views, {.map = {}, .reference = unknown}), InputError);
}

}  // namespace
}  // namespace retint
