// SPDX-License-Identifier: BSD-3-Clause
// Neighbor queries on 3D points. Only its .cc includes PCL in this folder.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include "kernels/backend.h"

namespace retint {

// Ascending indices of the points that PCL's StatisticalOutlierRemoval keeps. It drops a point if
// its mean distance to its `neighbors` nearest exceeds mean + stddev_factor * standard deviation of
// that distance over all points. All of `neighbors` + 1 or fewer points are kept. Searches on
// `backend` if it can, with the same result; null: on the host.
std::vector<int> StatisticalInliers(const std::vector<Eigen::Vector3f>& points, int neighbors,
                                    double stddev_factor, Backend* backend = nullptr);

struct Neighbor {
  int idx = -1;  // -1: there is none
  float distance = 0;
};

// The `count` nearest other points of every point, nearest first: [points, count].
std::vector<Neighbor> NearestNeighbors(const std::vector<Eigen::Vector3f>& points, int count);

// A k-d tree over a copy of points.
class PointTree {
 public:
  explicit PointTree(const std::vector<Eigen::Vector3f>& points);
  ~PointTree();
  // Index of the nearest point and the distance to it; -1 when the tree is empty.
  int Nearest(const Eigen::Vector3f& query, float* distance) const;
  // Mean distance to the `count` nearest other points of the point `idx`; 0 when there are none.
  float Spacing(int idx, int count) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace retint
