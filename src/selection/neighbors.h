// SPDX-License-Identifier: BSD-3-Clause
// Neighbor queries on 3D points: the only door to PCL in this folder.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include "kernels/backend.h"

namespace retint {

// Indices, ascending, of the points that survive PCL's StatisticalOutlierRemoval: those whose mean
// distance to their `neighbors` nearest does not exceed mean + stddev_factor * standard deviation
// of that distance over all points. With no more points than `neighbors` + 1, all survive. The
// search runs on `backend` where it supports that, with the same result; null: on the host.
std::vector<int> StatisticalInliers(const std::vector<Eigen::Vector3f>& points, int neighbors,
                                    double stddev_factor, Backend* backend = nullptr);

struct Neighbor {
  int idx = -1;  // -1: there is none
  float distance = 0;
};

// The `count` nearest other points of every point, nearest first: [points, count].
std::vector<Neighbor> NearestNeighbors(const std::vector<Eigen::Vector3f>& points, int count);

// A k-d tree over points that it keeps a copy of.
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
