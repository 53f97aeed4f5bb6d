// SPDX-License-Identifier: BSD-3-Clause
// Outliers by the search of each backend, against PCL's search and the filter's definition.
#include "selection/neighbors.h"

#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <pcl/kdtree/kdtree_flann.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

namespace retint {
namespace {

// Two walls, one as a depth map gives it, and single points in the space about them.
std::vector<Eigen::Vector3f> Cloud() {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> unit(-1, 1);
  std::vector<Eigen::Vector3f> points;
  for (int y = 0; y < 40; ++y) {
    for (int x = 0; x < 50; ++x) {
      points.emplace_back(0.02f * float(x) + 0.004f * unit(random), 0.02f * float(y),
                          0.004f * unit(random));
    }
  }
  for (int i = 0; i < 1000; ++i) {
    points.emplace_back(0.5f * unit(random), -0.3f, 0.5f * unit(random));
  }
  for (int i = 0; i < 60; ++i) points.emplace_back(unit(random), unit(random), unit(random));
  return points;
}

// Rusu et al. 2008, in double precision over PCL's exact search.
std::vector<int> Expected(const std::vector<Eigen::Vector3f>& points, int neighbors,
                          double stddev_factor) {
  pcl::PointCloud<pcl::PointXYZ>::Ptr cloud(new pcl::PointCloud<pcl::PointXYZ>);
  for (const auto& point : points) cloud->push_back({point.x(), point.y(), point.z()});
  pcl::KdTreeFLANN<pcl::PointXYZ> tree;
  tree.setInputCloud(cloud);
  std::vector<double> distances;
  double sum = 0, squares = 0;
  for (const auto& point : *cloud) {
    std::vector<int> indices;
    std::vector<float> squared;
    tree.nearestKSearch(point, neighbors + 1, indices, squared);
    double distance = 0;
    for (size_t k = 1; k < squared.size(); ++k) distance += std::sqrt(double(squared[k]));
    distances.push_back(distance / neighbors);
    sum += distances.back();
    squares += distances.back() * distances.back();
  }
  const double count = double(points.size());
  const double limit =
      sum / count + stddev_factor * std::sqrt((squares - sum * sum / count) / (count - 1));
  std::vector<int> kept;
  for (size_t i = 0; i < distances.size(); ++i) {
    if (distances[i] <= limit) kept.push_back(int(i));
  }
  return kept;
}

class Outliers : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    if (GetParam() == "none") return;
    try {
      backend_ = CreateBackend(GetParam());
    } catch (const std::exception& error) {
      ASSERT_EQ(GetParam(), "cuda") << error.what();
      GTEST_SKIP() << error.what();
    }
  }
  std::shared_ptr<Backend> backend_;
};
INSTANTIATE_TEST_SUITE_P(, Outliers, testing::Values("none", "cpu", "cuda"),
                         [](const auto& backend) { return backend.param; });

TEST_P(Outliers, AreThoseOfPclsSearch) {
  const auto points = Cloud();
  for (const auto& [neighbors, factor] : {std::pair{4, 1.0}, {16, 2.0}, {32, 0.5}, {40, 1.0}}) {
    const auto expected = Expected(points, neighbors, factor);
    EXPECT_LT(expected.size(), points.size());
    EXPECT_GT(expected.size(), points.size() / 2);
    EXPECT_EQ(StatisticalInliers(points, neighbors, factor, backend_.get()), expected) << neighbors;
  }
}

// Far from the origin, where floats are coarse, the points' own center is taken off first.
TEST_P(Outliers, DoNotDependOnWhereTheCloudIs) {
  auto points = Cloud();
  // Steps of 2^-10 are exact at either place.
  for (auto& point : points) {
    for (int axis = 0; axis < 3; ++axis) point[axis] = std::round(point[axis] * 1024) / 1024;
  }
  const auto here = StatisticalInliers(points, 16, 2, backend_.get());
  for (auto& point : points) point += Eigen::Vector3f(1024, -512, 256);
  EXPECT_EQ(StatisticalInliers(points, 16, 2, backend_.get()), here);
}

// A splat may have a Gaussian that training threw far away: the other points keep their digits.
TEST(NearestNeighbors, DoNotDependOnOnePointThatIsVeryFar) {
  auto points = Cloud();
  constexpr int kCount = 16;
  const auto without = NearestNeighbors(points, kCount);
  points.emplace_back(1e15f, -1e15f, 1e15f);
  const auto with = NearestNeighbors(points, kCount);
  ASSERT_EQ(with.size(), without.size() + kCount);
  for (size_t i = 0; i < without.size(); ++i) {
    // Equally near points may change places, so the test compares distances. Another center may be
    // subtracted, which rounds them by an ulp of coordinates near 1.
    ASSERT_NEAR(with[i].distance, without[i].distance, 1e-6f) << i;
  }
}

TEST_P(Outliers, AreNoneAmongFewPoints) {
  const std::vector<Eigen::Vector3f> points = {{0, 0, 0}, {1, 0, 0}, {50, 0, 0}};
  EXPECT_EQ(StatisticalInliers(points, 2, 0.1, backend_.get()), (std::vector<int>{0, 1, 2}));
  EXPECT_EQ(StatisticalInliers({}, 2, 0.1, backend_.get()), std::vector<int>());
}

}  // namespace
}  // namespace retint
