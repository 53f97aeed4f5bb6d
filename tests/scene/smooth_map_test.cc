// SPDX-License-Identifier: BSD-3-Clause
#include "scene/smooth_map.h"

#include <atomic>
#include <cmath>
#include <optional>
#include <vector>

#include <gtest/gtest.h>

namespace retint {
namespace {

constexpr int kWidth = 333, kHeight = 201;
constexpr double kTolerance = 1e-3;

using Find = std::optional<Eigen::Vector2d> (*)(double x, double y);

struct Result {
  std::vector<Eigen::Vector2d> values;  // no value: unchanged
  std::vector<int> writes;
  int computed = 0;
};

Result Mapped(Find find) {
  constexpr size_t kPixels = size_t(kWidth) * kHeight;
  Result result{std::vector<Eigen::Vector2d>(kPixels, Eigen::Vector2d(-1, -1)),
                std::vector<int>(kPixels), 0};
  std::atomic<int> computed = 0;
  ForSmooth<Eigen::Vector2d>(
      kWidth, kHeight, kTolerance,
      [&](double x, double y) {
        ++computed;
        return find(x, y);
      },
      [&](int x, int y, const Eigen::Vector2d& value) {
        const size_t i = size_t(y) * kWidth + size_t(x);
        result.values[i] = value;
        ++result.writes[i];
      });
  result.computed = computed;
  return result;
}

void ExpectFollows(const Result& result, Find find, double tolerance) {
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const size_t i = size_t(y) * kWidth + size_t(x);
      const auto exact = find(x + 0.5, y + 0.5);
      ASSERT_EQ(result.writes[i], exact ? 1 : 0) << x << " " << y;
      if (!exact) continue;
      ASSERT_LE((result.values[i] - *exact).norm(), tolerance) << x << " " << y;
    }
  }
}

TEST(ForSmooth, ComputesLittleOfWhatIsSmooth) {
  const Find lens = [](double x, double y) -> std::optional<Eigen::Vector2d> {
    const Eigen::Vector2d at((x - 160) / 800, (y - 100) / 800);
    return Eigen::Vector2d(800 * at * (1 - 0.2 * at.squaredNorm()));
  };
  const Result result = Mapped(lens);
  ExpectFollows(result, lens, 2 * kTolerance);
  EXPECT_LT(result.computed, kWidth * kHeight / 8);  // most of it at the borders
}

TEST(ForSmooth, ComputesWhatIsNot) {
  const Find rough = [](double x, double y) -> std::optional<Eigen::Vector2d> {
    return Eigen::Vector2d(x + 30 * std::sin(x * y), y);
  };
  ExpectFollows(Mapped(rough), rough, 1e-9);
}

TEST(ForSmooth, WritesNothingWhereThereIsNothing) {
  const Find disc = [](double x, double y) -> std::optional<Eigen::Vector2d> {
    if (std::hypot(x - 170, y - 90) > 80) return std::nullopt;
    return Eigen::Vector2d(2 * x, 3 * y);
  };
  const Result result = Mapped(disc);
  ExpectFollows(result, disc, 1e-9);
  EXPECT_LT(result.computed, 2 * kWidth * kHeight);
}

}  // namespace
}  // namespace retint
