// SPDX-License-Identifier: BSD-3-Clause
#include "selection/neighbors.h"

#include <cmath>
#include <numeric>

#include <pcl/filters/statistical_outlier_removal.h>
#include <pcl/kdtree/kdtree_flann.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

namespace retint {
namespace {

using PclCloud = pcl::PointCloud<pcl::PointXYZ>;

// Centred, so that clouds far from the world's origin keep their float digits.
PclCloud::Ptr ToPcl(const std::vector<Eigen::Vector3f>& points, Eigen::Vector3f* center) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const auto& point : points) sum += point.cast<double>();
  *center = points.empty() ? Eigen::Vector3f::Zero()
                           : (sum / static_cast<double>(points.size())).cast<float>().eval();
  PclCloud::Ptr cloud(new PclCloud);
  cloud->reserve(points.size());
  for (const auto& point : points) {
    const Eigen::Vector3f moved = point - *center;
    cloud->push_back(pcl::PointXYZ(moved.x(), moved.y(), moved.z()));
  }
  return cloud;
}

}  // namespace

std::vector<int> StatisticalInliers(const std::vector<Eigen::Vector3f>& points, int neighbors,
                                    double stddev_factor) {
  std::vector<int> kept(points.size());
  std::iota(kept.begin(), kept.end(), 0);
  // PCL 1.13 reads past its neighbour lists when there are fewer points than it asks for.
  if (neighbors <= 0 || points.size() <= static_cast<size_t>(neighbors) + 1) return kept;
  Eigen::Vector3f center;
  pcl::StatisticalOutlierRemoval<pcl::PointXYZ> filter;
  filter.setInputCloud(ToPcl(points, &center));
  filter.setMeanK(neighbors);
  filter.setStddevMulThresh(stddev_factor);
  filter.filter(kept);
  return kept;
}

struct PointTree::Impl {
  PclCloud::Ptr cloud;
  Eigen::Vector3f center;
  pcl::KdTreeFLANN<pcl::PointXYZ> tree;
};

PointTree::PointTree(const std::vector<Eigen::Vector3f>& points) : impl_(new Impl) {
  impl_->cloud = ToPcl(points, &impl_->center);
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
