// SPDX-License-Identifier: BSD-3-Clause
// Distances to the nearest points against a search by sorting.
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "tests/kernels/test_scene.h"

namespace retint {
namespace {

class NeighborsOp : public BackendTest {
 protected:
  std::vector<float> Found(const std::vector<float>& points, int neighbors) {
    Guarded<float> uploaded(*backend_, points), distances(*backend_, points.size() / 3);
    backend_->neighbors()->NeighborDistances(
        {uploaded.data(), int64_t(points.size() / 3), neighbors, distances.data()});
    return distances.Read();
  }

  void SetUp() override {
    BackendTest::SetUp();
    if (!IsSkipped() && !backend_->neighbors()) GTEST_SKIP() << "the backend has no search";
  }
};

std::vector<float> Expected(const std::vector<float>& points, int neighbors) {
  const size_t count = points.size() / 3;
  std::vector<float> expected(count), squared(count);
  for (size_t i = 0; i < count; ++i) {
    for (size_t j = 0; j < count; ++j) {
      volatile float sum = 0;  // no fused operation
      for (size_t axis = 0; axis < 3; ++axis) {
        const float difference = points[3 * i + axis] - points[3 * j + axis];
        volatile float square = difference * difference;
        sum = sum + square;
      }
      squared[j] = sum;
    }
    std::partial_sort(squared.begin(), squared.begin() + neighbors + 1, squared.end());
    double sum = 0;
    for (int k = 1; k <= neighbors; ++k) sum += double(std::sqrt(squared[size_t(k)]));
    expected[i] = float(sum / neighbors);
  }
  return expected;
}

TEST_P(NeighborsOp, AreTheMeanOfTheNearest) {
  for (const auto& [count, neighbors] :
       {std::pair{2, 1}, {17, 16}, {130, 3}, {3000, 16}, {3000, 32}}) {
    // Some in rows as a depth map gives them, some anywhere, some twice.
    auto points = UniformVector(rng_, size_t(count) * 3, -1, 1);
    for (int i = 0; i < count / 2; ++i) {
      points[size_t(i) * 3] += float(i % 50);
      points[size_t(i) * 3 + 1] = float(i / 50);
      points[size_t(i) * 3 + 2] = 5;
    }
    for (int i = 0; i + 7 < count / 8; ++i) {
      std::copy_n(points.begin() + 3 * i, 3, points.end() - 3 * (i + 1));
    }
    EXPECT_EQ(Found(points, neighbors), Expected(points, neighbors)) << count << ", " << neighbors;
  }
}

TEST_P(NeighborsOp, RefuseWhatCannotBe) {
  const std::vector<float> points(30, 0.5f);
  EXPECT_THROW(Found(points, 0), std::invalid_argument);
  EXPECT_THROW(Found(points, 10), std::invalid_argument);
  EXPECT_THROW(Found(std::vector<float>(300, 0.5f), kMaxNeighbors + 1), std::invalid_argument);
  EXPECT_EQ(Found(points, 9), std::vector<float>(10, 0.0f));
}

RETINT_INSTANTIATE(NeighborsOp);

}  // namespace
}  // namespace retint
