// SPDX-License-Identifier: BSD-3-Clause
#include "selection/registration_solver.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include <gtest/gtest.h>

namespace retint {
namespace {

constexpr double kNoise = 0.005;  // of the depth
constexpr int kUnknowns = 9;

// The unknown numbered as the derivatives are.
double& Unknown(RegistrationTransform& transform, int i) {
  if (i == 0) return transform.a;
  if (i == 1) return transform.b;
  if (i == 2) return transform.log_scale;
  return i < 6 ? transform.angle_axis[i - 3] : transform.translation[i - 6];
}

RegistrationTransform Disturbance() {
  RegistrationTransform transform;
  transform.a = 1.02;
  transform.b = -0.004;
  transform.log_scale = 0.03;
  transform.angle_axis = {0.02, -0.03, 0.01};
  transform.translation = {0.03, -0.02, 0.05};
  transform.center = {0.1, -0.2, 4};
  return transform;
}

class RegistrationSolverTest : public ::testing::Test {
 protected:
  std::mt19937 rng{5};

  double Uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(rng);
  }
  // Points about 4 units away. `truth` moves them to their sparse points, except for noise. Every
  // second one has a normal, every tenth is wrong, every fifth is held out.
  std::vector<RegistrationPair> Pairs(const RegistrationTransform& truth) {
    const RegistrationMap map(truth);
    std::normal_distribution<double> normal(0, kNoise * 4);
    std::vector<RegistrationPair> pairs(600);
    for (size_t i = 0; i < pairs.size(); ++i) {
      RegistrationPair& pair = pairs[i];
      pair.cloud = {Uniform(-1, 1), Uniform(-1, 1), Uniform(3, 5)};
      pair.sparse = map * pair.cloud + Eigen::Vector3d(normal(rng), normal(rng), normal(rng));
      if (i % 2 == 0) {
        pair.normal = Eigen::Vector3d(Uniform(-1, 1), Uniform(-1, 1), -1).normalized();
      }
      if (i % 10 == 3) pair.sparse *= 1.1;
      pair.heldout = i % 5 == 4;
    }
    return pairs;
  }

  static double MedianDepth(const std::vector<RegistrationPair>& pairs) {
    std::vector<double> depths;
    for (const auto& pair : pairs) depths.push_back(pair.sparse.z());
    std::sort(depths.begin(), depths.end());
    return depths[depths.size() / 2];
  }
  static double DepthPriors(const RegistrationTransform& at, double depth) {
    return std::pow((at.a - 1) / 0.1, 2) + std::pow(at.b * depth / 0.1, 2);
  }
  // The costs that FitDepth and FitAll minimize, from registration_solver.h.
  static double DepthCost(const std::vector<RegistrationPair>& pairs,
                          const RegistrationTransform& at) {
    double sum = DepthPriors(at, MedianDepth(pairs));
    for (const auto& pair : pairs) {
      const double off = ((at.a / pair.cloud.z() + at.b) * pair.sparse.z() - 1) / kNoise;
      if (!pair.heldout) sum += std::log1p(off * off);
    }
    return sum;
  }
  static double Cost(const std::vector<RegistrationPair>& pairs, const RegistrationTransform& at) {
    const RegistrationMap map(at);
    const double depth = MedianDepth(pairs);
    double sum = DepthPriors(at, depth) + std::pow(at.log_scale / 0.1, 2) +
                 at.angle_axis.squaredNorm() / std::pow(0.05, 2) +
                 at.translation.squaredNorm() / std::pow(0.1 * depth, 2);
    for (const auto& pair : pairs) {
      if (pair.heldout) continue;
      const Eigen::Vector3d off = (map * pair.cloud - pair.sparse) / (kNoise * pair.sparse.z());
      const double across = std::pow(pair.normal.dot(off), 2), all = off.squaredNorm();
      sum += std::log1p(pair.normal.isZero() ? all : across + (all - across) / 9);
    }
    return sum;
  }
  // A step of any of the first `count` unknowns must cost more. It moves hundreds of points by a
  // quarter of the noise, which costs far more than Ceres's remaining error, a millionth.
  static void ExpectLeast(const RegistrationTransform& found, int count,
                          const std::function<double(const RegistrationTransform&)>& cost) {
    constexpr double kSteps[kUnknowns] = {2e-3, 5e-4, 1e-2, 1e-2, 1e-2, 1e-2, 5e-3, 5e-3, 5e-3};
    for (int i = 0; i < count; ++i) {
      for (const double sign : {-1.0, 1.0}) {
        RegistrationTransform beside = found;
        Unknown(beside, i) += sign * kSteps[i];
        EXPECT_GT(cost(beside), cost(found)) << "unknown " << i << ", sign " << sign;
      }
    }
  }
};

TEST_F(RegistrationSolverTest, DerivativesAreDifferences) {
  for (const double turn : {0.0, 1e-12, 1e-5, 0.04, 1.0, 3.0}) {
    RegistrationTransform at = Disturbance();
    at.angle_axis = turn * Eigen::Vector3d(2, -1, 0.5).normalized();
    const Eigen::Vector3d point(0.7, -0.4, 3.5);
    const auto derivatives = RegistrationMap(at).DerivativesAt(point);
    for (int i = 0; i < kUnknowns; ++i) {
      constexpr double kStep = 1e-5;
      RegistrationTransform before = at, after = at;
      Unknown(before, i) -= kStep;
      Unknown(after, i) += kStep;
      const Eigen::Vector3d difference =
          (RegistrationMap(after) * point - RegistrationMap(before) * point) / (2 * kStep);
      // The rounding of positions of size 5 over the step, and the third derivative's part.
      EXPECT_LT((derivatives.col(i) - difference).norm(), 1e-7) << "turn " << turn << ", " << i;
    }
  }
}

TEST_F(RegistrationSolverTest, MapIsTheDepthCorrectionThenTheSimilarity) {
  const RegistrationTransform at = Disturbance();
  const Eigen::Vector3d point(0.7, -0.4, 3.5);
  const Eigen::Vector3d corrected = point / (1.02 - 0.004 * 3.5);
  const Eigen::Vector3d turned =
      Eigen::AngleAxisd(at.angle_axis.norm(), at.angle_axis.normalized()) *
      Eigen::Vector3d(corrected - at.center);
  const Eigen::Vector3d expected = at.center + std::exp(0.03) * turned + at.translation;
  EXPECT_LT((RegistrationMap(at) * point - expected).norm(), 1e-12);  // rounding
}

TEST_F(RegistrationSolverTest, FitsWhatCostsLeast) {
  const RegistrationTransform truth = Disturbance();
  const auto pairs = Pairs(truth);
  RegistrationTransform found;
  found.center = truth.center;
  EXPECT_EQ(FitAll(pairs, kNoise, &found).substr(0, 11), "CONVERGENCE");
  ExpectLeast(found, kUnknowns, [&](const auto& at) { return Cost(pairs, at); });
  // The remaining noise of 480 points is below that of one.
  const RegistrationMap map(found), exact(truth);
  for (const auto& pair : pairs) {
    EXPECT_LT((map * pair.cloud - exact * pair.cloud).norm(), kNoise * 4);
  }
}

TEST_F(RegistrationSolverTest, FitsTheDepthThatCostsLeast) {
  RegistrationTransform truth;
  truth.a = 1.04;
  truth.b = -0.006;
  const auto pairs = Pairs(truth);
  RegistrationTransform found = Disturbance();
  FitDepth(pairs, kNoise, &found);
  ExpectLeast(found, 2, [&](const auto& at) { return DepthCost(pairs, at); });
  EXPECT_EQ(found.log_scale, Disturbance().log_scale);  // the rest is left alone
}

}  // namespace
}  // namespace retint
