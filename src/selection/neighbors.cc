// SPDX-License-Identifier: BSD-3-Clause
#include "selection/neighbors.h"

#include "base/median.h"
#include "base/parallel.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>

#include <pcl/kdtree/kdtree_flann.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

namespace retint {
namespace {

using PclCloud = pcl::PointCloud<pcl::PointXYZ>;

// Points relative to the median of each axis. Clouds far from the world's origin keep their float
// digits, even if a few points are very far from all others.
std::vector<Eigen::Vector3f> Centered(const std::vector<Eigen::Vector3f>& points,
                                      Eigen::Vector3f* center) {
  std::vector<float> values(points.size());
  for (int axis = 0; axis < 3; ++axis) {
    std::transform(points.begin(), points.end(), values.begin(),
                   [axis](const Eigen::Vector3f& point) { return point[axis]; });
    (*center)[axis] = points.empty() ? 0 : Quantile(values, 0.5);
  }
  std::vector<Eigen::Vector3f> centered(points.size());
  std::transform(points.begin(), points.end(), centered.begin(),
                 [&](const Eigen::Vector3f& point) { return (point - *center).eval(); });
  return centered;
}

PclCloud::Ptr ToPcl(const std::vector<Eigen::Vector3f>& points) {
  PclCloud::Ptr cloud(new PclCloud);
  cloud->reserve(points.size());
  for (const auto& point : points) cloud->push_back({point.x(), point.y(), point.z()});
  return cloud;
}

std::vector<float> NeighborDistances(const std::vector<Eigen::Vector3f>& points, int neighbors) {
  const PclCloud::Ptr cloud = ToPcl(points);
  pcl::KdTreeFLANN<pcl::PointXYZ> tree;
  tree.setInputCloud(cloud);
  std::vector<float> distances(points.size());
  ParallelRanges(int64_t(points.size()), 256, [&](int64_t begin, int64_t end) {
    std::vector<int> indices;
    std::vector<float> squared;
    for (auto i = size_t(begin); i < size_t(end); ++i) {
      tree.nearestKSearch((*cloud)[i], neighbors + 1, indices, squared);
      double sum = 0;
      for (size_t k = 1; k < squared.size(); ++k) sum += std::sqrt(squared[k]);
      distances[i] = static_cast<float>(sum / neighbors);
    }
  });
  return distances;
}

std::vector<float> NeighborDistances(const std::vector<Eigen::Vector3f>& points, int neighbors,
                                     Backend& backend) {
  static_assert(sizeof(Eigen::Vector3f) == 3 * sizeof(float));
  const auto uploaded =
      backend.Upload(std::span<const float>(points.front().data(), 3 * points.size()));
  const auto distances = backend.Allocate<float>(points.size());
  backend.neighbors()->NeighborDistances(
      {uploaded.data(), static_cast<int64_t>(points.size()), neighbors, distances.data()});
  return backend.Download(distances.data(), distances.size());
}

}  // namespace

// The filter of pcl::StatisticalOutlierRemoval (Rusu et al. 2008), with searches on several
// threads.
std::vector<int> StatisticalInliers(const std::vector<Eigen::Vector3f>& points, int neighbors,
                                    double stddev_factor, Backend* backend) {
  std::vector<int> kept;
  if (neighbors <= 0 || points.size() <= static_cast<size_t>(neighbors) + 1) {
    kept.resize(points.size());
    std::iota(kept.begin(), kept.end(), 0);
    return kept;
  }
  Eigen::Vector3f center;
  const std::vector<Eigen::Vector3f> centered = Centered(points, &center);
  const bool on_backend = backend && backend->neighbors() && neighbors <= kMaxNeighbors;
  const std::vector<float> distances = on_backend ? NeighborDistances(centered, neighbors, *backend)
                                                  : NeighborDistances(centered, neighbors);
  double sum = 0, squares = 0;
  for (const float distance : distances) {
    sum += distance;
    squares += distance * distance;
  }
  const auto count = static_cast<double>(points.size());
  const double variance = (squares - sum * sum / count) / (count - 1);
  const double limit = sum / count + stddev_factor * std::sqrt(std::max(0.0, variance));
  kept.reserve(points.size());
  for (size_t i = 0; i < points.size(); ++i) {
    if (distances[i] <= limit) kept.push_back(static_cast<int>(i));
  }
  return kept;
}

std::vector<Neighbor> NearestNeighbors(const std::vector<Eigen::Vector3f>& points, int count) {
  std::vector<Neighbor> nearest(points.size() * size_t(count));
  if (points.empty()) return nearest;
  Eigen::Vector3f center;
  const PclCloud::Ptr cloud = ToPcl(Centered(points, &center));
  pcl::KdTreeFLANN<pcl::PointXYZ> tree;
  tree.setInputCloud(cloud);
  ParallelRanges(int64_t(points.size()), 256, [&](int64_t begin, int64_t end) {
    std::vector<int> indices;
    std::vector<float> squared;
    for (auto i = size_t(begin); i < size_t(end); ++i) {
      const int found = tree.nearestKSearch((*cloud)[i], count + 1, indices, squared);
      Neighbor* const row = &nearest[i * size_t(count)];
      int kept = 0;
      for (int k = 0; k < found && kept < count; ++k) {
        if (size_t(indices[size_t(k)]) == i) continue;
        row[kept++] = {indices[size_t(k)], std::sqrt(squared[size_t(k)])};
      }
    }
  });
  return nearest;
}

struct PointTree::Impl {
  PclCloud::Ptr cloud;
  Eigen::Vector3f center;
  pcl::KdTreeFLANN<pcl::PointXYZ> tree;
};

PointTree::PointTree(const std::vector<Eigen::Vector3f>& points) : impl_(new Impl) {
  impl_->cloud = ToPcl(Centered(points, &impl_->center));
  if (!points.empty()) impl_->tree.setInputCloud(impl_->cloud);
}

PointTree::~PointTree() = default;

int PointTree::Nearest(const Eigen::Vector3f& query, float* distance) const {
  if (impl_->cloud->empty()) return -1;
  const Eigen::Vector3f moved = query - impl_->center;
  std::vector<int> indices;
  std::vector<float> squared;
  if (impl_->tree.nearestKSearch(pcl::PointXYZ(moved.x(), moved.y(), moved.z()), 1, indices,
                                 squared) < 1) {
    return -1;
  }
  *distance = std::sqrt(squared[0]);
  return indices[0];
}

float PointTree::Spacing(int idx, int count) const {
  const int available = std::min(count, static_cast<int>(impl_->cloud->size()) - 1);
  if (available < 1) return 0;
  std::vector<int> indices;
  std::vector<float> squared;
  const int found = impl_->tree.nearestKSearch((*impl_->cloud)[static_cast<size_t>(idx)],
                                               available + 1, indices, squared);
  double sum = 0;
  for (int i = 1; i < found; ++i) sum += std::sqrt(squared[static_cast<size_t>(i)]);
  return found > 1 ? static_cast<float>(sum / (found - 1)) : 0;
}

}  // namespace retint
