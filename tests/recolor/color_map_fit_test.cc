// SPDX-License-Identifier: BSD-3-Clause
#include "recolor/color_map_fit.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "base/color_difference.h"
#include "kernels/common/color_ops.h"
#include "recolor/color_edit.h"

namespace retint {
namespace {

using Eigen::Vector3f;

struct Pairs {
  std::vector<float> before, after;

  void Add(const Vector3f& x, const Vector3f& y) {
    before.insert(before.end(), x.data(), x.data() + 3);
    after.insert(after.end(), y.data(), y.data() + 3);
  }
};

// Colors of a shaded yellow surface, as a photo has them.
Vector3f SomeColor(std::mt19937& random) {
  std::uniform_real_distribution<float> light(0.2f, 1.0f), tone(-0.05f, 0.05f);
  const float shade = light(random);
  return Vector3f(0.9f * shade + tone(random), 0.7f * shade + tone(random),
                  0.2f * shade + tone(random))
      .cwiseMax(0.0f)
      .cwiseMin(1.0f);
}

ColorEdit Grade() {
  return {{ColorOperation::Make(ColorOperationKind::kGamma, {1.3f}),
           ColorOperation::Make(ColorOperationKind::kAdjust, {70, 0.9f})},
          1};
}

Vector3f Rounded(const Vector3f& color) {
  return (color.cwiseMax(0.0f).cwiseMin(1.0f) * 255).array().round() / 255;
}

double Difference(const Vector3f& x, const Vector3f& y) {
  return ColorDifference(CieLabFromSrgb(x.data()), CieLabFromSrgb(y.data()));
}

Vector3f Looked(const ColorTable& table, const Vector3f& color) {
  Vector3f found = color;
  TableColor(table.values.data(), table.size, found.data());
  return found;
}

TEST(ColorMapFitTest, RecoversAGradeDespitePaintOnIt) {
  std::mt19937 random(5);
  const CompiledEdit grade(Grade());
  Pairs pairs;
  for (int i = 0; i < 4000; ++i) {
    const Vector3f color = SomeColor(random);
    // A tenth is lettering in white.
    pairs.Add(color, i % 10 == 0 ? Vector3f(1, 1, 1) : Rounded(grade.Apply(color)));
  }
  const ColorTable table = FitColorTable(pairs.before, pairs.after);
  ASSERT_NO_THROW(table.Check());
  std::vector<double> differences;
  for (int i = 0; i < 500; ++i) {
    const Vector3f color = SomeColor(random);
    differences.push_back(Difference(Looked(table, color), Rounded(grade.Apply(color))));
  }
  std::sort(differences.begin(), differences.end());
  // Sixteen cells a side and eight bits: nothing that can be seen, with room at the few colors on
  // the border of those that there are.
  EXPECT_LT(differences[250], 0.5);
  EXPECT_LT(differences[475], 1.0);
}

TEST(ColorMapFitTest, GoesOnSteadilyBeyondWhatWasSeen) {
  Pairs pairs;
  const Vector3f seen(0.8f, 0.2f, 0.2f), becomes(0.75f, 0.25f, 0.2f);
  for (int i = 0; i < 100; ++i) pairs.Add(seen, becomes);
  const ColorTable table = FitColorTable(pairs.before, pairs.after);
  // A hundred pairs against a stiffness of 0.3.
  EXPECT_LT((Looked(table, seen) - becomes).norm(), 0.01f);
  for (const float value : table.values) EXPECT_TRUE(value >= 0 && value <= 1);
  // An extrapolation from one color changes at most as that color does.
  const Vector3f far(0.1f, 0.6f, 0.9f);
  EXPECT_LT((Looked(table, far) - far).norm(), (becomes - seen).norm() + 0.01f);
}

TEST(ColorMapFitTest, NothingChangedIsTheIdentity) {
  std::mt19937 random(6);
  Pairs pairs;
  for (int i = 0; i < 200; ++i) {
    const Vector3f color = SomeColor(random);
    pairs.Add(color, color);
  }
  const ColorTable table = FitColorTable(pairs.before, pairs.after);
  const Vector3f color(0.3f, 0.8f, 0.5f);
  EXPECT_LT((Looked(table, color) - color).norm(), 1e-4f);  // float's rounding
}

}  // namespace
}  // namespace retint
