// SPDX-License-Identifier: BSD-3-Clause
#include "selection/gaussian_graph.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "base/error.h"
#include "selection/gaussian_mixture.h"

namespace retint {
namespace {

constexpr float kY00 = 0.28209479177387814f;

// Round Gaussians in a row along x, one unit apart, red below `border` and blue from it on.
GaussianModel Row(int count, int border) {
  GaussianModel model;
  for (int i = 0; i < count; ++i) {
    for (const float value : {float(i), 0.0f, 0.0f}) model.means.push_back(value);
    for (const float value : {1.0f, 0.0f, 0.0f, 0.0f}) model.quats_wxyz.push_back(value);
    for (int axis = 0; axis < 3; ++axis) model.log_scales.push_back(0);
    model.opacity_logits.push_back(3);
    for (const float channel : {i < border ? 0.9f : 0.1f, 0.1f, i < border ? 0.1f : 0.9f}) {
      model.sh.push_back((channel - 0.5f) / kY00);
    }
  }
  return model;
}

float Weight(const GaussianGraph& graph, size_t a, int b) {
  const EdgeMatrix& edges = graph.edges();
  for (size_t e = edges.begin[a]; e < edges.begin[a + 1]; ++e) {
    if (edges.other[e] == b) return edges.weight[e];
  }
  return 0;
}

TEST(GaussianGraph, JoinsNeighborsByDistanceAndColor) {
  Monitor monitor;
  const GaussianGraph graph(Row(100, 50), monitor);
  ASSERT_EQ(graph.NumNodes(), 100u);
  // Extents of 1 and a scale of twice their sum: 1 / (1 + (distance / 4)^2). Float rounding.
  EXPECT_NEAR(Weight(graph, 10, 11), 1 / (1 + 1 / 16.0), 1e-5);
  EXPECT_NEAR(Weight(graph, 10, 14), 0.5, 1e-5);
  EXPECT_EQ(Weight(graph, 10, 11), Weight(graph, 11, 10));
  EXPECT_LT(Weight(graph, 49, 50), 1e-3);  // red beside blue
  EXPECT_GT(Weight(graph, 49, 50), 0);
  EXPECT_EQ(Weight(graph, 10, 60), 0);  // no neighbors
}

TEST(GaussianGraph, OfABoxHasTheGaussiansInIt) {
  Monitor monitor;
  const Eigen::AlignedBox3f box(Eigen::Vector3f(20.5f, -1, -1), Eigen::Vector3f(60.5f, 1, 1));
  const GaussianGraph graph(Row(100, 50), monitor, box);
  ASSERT_EQ(graph.NumNodes(), 40u);
  EXPECT_EQ(graph.NumGaussians(), 100u);
  EXPECT_EQ(graph.GaussianOf(0), 21u);
  EXPECT_EQ(graph.GaussianOf(39), 60u);
  EXPECT_NEAR(Weight(graph, 0, 1), 1 / (1 + 1 / 16.0), 1e-5);
  const Eigen::AlignedBox3f smaller(Eigen::Vector3f(30, 0, 0), Eigen::Vector3f(40, 1, 1));
  const Eigen::AlignedBox3f other(Eigen::Vector3f(30, 0, 0), Eigen::Vector3f(70, 1, 1));
  EXPECT_TRUE(graph.Covers(smaller));
  EXPECT_FALSE(graph.Covers(other));
  EXPECT_FALSE(graph.Covers(std::nullopt));
  EXPECT_TRUE(GaussianGraph(Row(20, 10), monitor).Covers(std::nullopt));
}

TEST(GaussianGraph, KnowsTheValleyOfEveryNode) {
  Monitor monitor;
  std::vector<float> valleys(100);
  for (size_t g = 0; g < valleys.size(); ++g) valleys[g] = float(g) / 100;
  const Eigen::AlignedBox3f box(Eigen::Vector3f(20.5f, -1, -1), Eigen::Vector3f(60.5f, 1, 1));
  const GaussianGraph graph(Row(100, 50), monitor, box, {valleys, {}});
  EXPECT_EQ(graph.surfaces()[0].valley, valleys[21]);
  EXPECT_EQ(graph.surfaces()[39].valley, valleys[60]);
  EXPECT_EQ(GaussianGraph(Row(100, 50), monitor).surfaces()[5].valley, 0);
  valleys.pop_back();
  EXPECT_THROW(GaussianGraph(Row(100, 50), monitor, std::nullopt, {valleys, {}}), OptionError);
}

TEST(GaussianGraph, KnowsWhatFloatsInTheWholeScene) {
  Monitor monitor;
  std::vector<float> floating(100, 0.1f);
  floating[3] = 0.9f;  // outside of the box
  floating[30] = 0.6f;
  const Eigen::AlignedBox3f box(Eigen::Vector3f(20.5f, -1, -1), Eigen::Vector3f(60.5f, 1, 1));
  const GaussianGraph graph(Row(100, 50), monitor, box, {{}, floating});
  EXPECT_EQ(graph.floating(), floating);
  for (size_t g = 0; g < 100; ++g) EXPECT_EQ(graph.Floats(g), g == 3 || g == 30) << g;
  EXPECT_FALSE(GaussianGraph(Row(100, 50), monitor).Floats(3));
  floating.pop_back();
  EXPECT_THROW(GaussianGraph(Row(100, 50), monitor, std::nullopt, {{}, floating}), OptionError);
}

TEST(GaussianGraph, SurroundingsLeaveOutStrayPoints) {
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i <= 1000; ++i) points.push_back(Eigen::Vector3f(float(i % 2), 0, 0));
  points.push_back({1000, 1000, 1000});
  const Eigen::AlignedBox3f box = Surroundings(points);  // of diagonal 1 before it grows
  EXPECT_EQ(box.min(), Eigen::Vector3f(-2, -2, -2));
  EXPECT_EQ(box.max(), Eigen::Vector3f(3, 2, 2));
}

TEST(GaussianMixture, FindsTwoClustersAndTheirWeights) {
  std::mt19937_64 random(1);
  const auto uniform = [&] { return double(random() >> 11) * 0x1p-53; };
  GaussianMixture<3>::Points samples(1500, 3);
  for (int i = 0; i < 1500; ++i) {
    // Sums of twelve uniform numbers less 6 are normal but for their tails.
    for (int axis = 0; axis < 3; ++axis) {
      double sum = -6;
      for (int k = 0; k < 12; ++k) sum += uniform();
      samples(i, axis) = float(0.1 * sum + (i % 3 == 0 && axis == 0 ? 2 : 0));
    }
  }
  const GaussianMixture<3> mixture(samples, 2, 0);
  ASSERT_EQ(mixture.NumComponents(), 2u);
  // At its mean a component has the density w / sigma^3 = w 1000. Of 500 and 1000 samples sigma^3
  // is known to some 5 %.
  GaussianMixture<3>::Points at(4, 3);
  at << 0, 0, 0, 2, 0, 0, 1, 0, 0, 1e6, 0, 0;
  const auto logs = mixture.LogLikelihoods(at);
  EXPECT_NEAR(logs[0], std::log(2 / 3.0 * 1000), 0.2);
  EXPECT_NEAR(logs[1], std::log(1 / 3.0 * 1000), 0.2);
  EXPECT_LT(logs[2], logs[0] - 20);
  EXPECT_EQ(logs[3], -690);
}

// Threads take points in pieces of any size, and must not tell where one ends.
TEST(GaussianMixture, LikelihoodsDoNotDependOnThePiecesThatAreAskedFor) {
  constexpr Eigen::Index kPoints = 3000;
  std::mt19937 random(11);
  GaussianMixture<3>::Points at(kPoints, 3);
  for (Eigen::Index i = 0; i < kPoints; ++i) {
    for (Eigen::Index c = 0; c < 3; ++c) at(i, c) = float(random()) * 0x1p-32f;
  }
  const GaussianMixture<3> mixture(at, 5, 0.01);
  const GaussianMixture<3>::Values all = mixture.LogLikelihoods(at);
  for (const Eigen::Index piece : {1, 3, 7, 1001}) {
    int differing = 0;
    for (Eigen::Index first = 0; first < kPoints; first += piece) {
      const Eigen::Index count = std::min(piece, kPoints - first);
      const auto some = mixture.LogLikelihoods(at.middleRows(first, count));
      for (Eigen::Index i = 0; i < count; ++i) differing += some[i] != all[first + i];
    }
    EXPECT_EQ(differing, 0) << piece;
  }
}

TEST(GaussianMixture, TakesFewAndEqualSamples) {
  GaussianMixture<3>::Points at(1, 3);
  at << 1, 2, 3;
  const GaussianMixture<3> none(GaussianMixture<3>::Points(0, 3), 5, 0.1);
  EXPECT_EQ(none.NumComponents(), 0u);
  EXPECT_EQ(none.LogLikelihoods(at)[0], -690);
  const GaussianMixture<3> one(at.replicate(40, 1), 5, 0.1);
  EXPECT_EQ(one.NumComponents(), 1u);
  EXPECT_NEAR(one.LogLikelihoods(at)[0], std::log(1000.0), 1e-4);
}

}  // namespace
}  // namespace retint
