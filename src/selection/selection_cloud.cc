// SPDX-License-Identifier: BSD-3-Clause
#include "selection/selection_cloud.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/error.h"
#include "base/parallel.h"
#include "scene/image_checks.h"
#include "scene/mask_pixels.h"
#include "selection/depth_sampling.h"
#include "selection/neighbors.h"
#include "selection/sampling.h"

namespace retint {
namespace {

constexpr int64_t kGrain = 1024;  // points

void RequirePinhole(const PosedCamera& view) {
  constexpr int kMaxSide = std::numeric_limits<uint16_t>::max();
  if (!view.camera.IsPinhole()) throw InputError("the view's camera model is not PINHOLE");
  if (view.camera.width > kMaxSide || view.camera.height > kMaxSide) {
    throw InputError("the view is larger than 65535 pixels a side");
  }
}

std::vector<size_t> SamplePixels(const std::vector<size_t>& pixels, double fraction,
                                 uint64_t seed) {
  const auto rounded = static_cast<size_t>(std::llround(fraction * double(pixels.size())));
  std::vector<size_t> sampled =
      SampleIndices(pixels.size(), std::clamp<size_t>(rounded, 1, pixels.size()), seed);
  for (auto& idx : sampled) idx = pixels[idx];
  return sampled;
}

uint8_t ToByte(float value) {
  return static_cast<uint8_t>(std::lround(std::clamp(value, 0.0f, 1.0f) * 255.0f));
}

void DropOutliers(const CloudOptions& options, Backend* backend,
                  std::vector<SelectionPoint>* points) {
  std::vector<Eigen::Vector3f> positions(points->size());
  std::transform(points->begin(), points->end(), positions.begin(),
                 [](const SelectionPoint& point) { return point.position; });
  size_t kept = 0;
  for (const int idx :
       StatisticalInliers(positions, options.outlier_neighbors, options.outlier_stddev, backend)) {
    (*points)[kept++] = (*points)[static_cast<size_t>(idx)];
  }
  points->resize(kept);
}

// The indices of painted pixels with depth, in order. `painted` counts all painted pixels.
std::vector<size_t> PixelsWithDepth(const Mask& mask, const DepthMap& depth, int64_t* painted) {
  *painted = std::count_if(mask.data.begin(), mask.data.end(), [](uint8_t m) { return m > 0; });
  constexpr int kRows = 32;  // per task
  std::vector<std::vector<size_t>> bands(static_cast<size_t>((mask.height + kRows - 1) / kRows));
  ParallelTasks(int64_t(bands.size()), [&](size_t band) {
    const int first = static_cast<int>(band) * kRows, last = std::min(first + kRows, mask.height);
    for (int y = first; y < last; ++y) {
      const size_t row = mask.Index(0, y);
      for (int x = 0; x < mask.width; ++x) {
        const size_t i = row + static_cast<size_t>(x);
        if (mask.data[i] > 0 && HasDepth(depth, x, y)) bands[band].push_back(i);
      }
    }
  });
  std::vector<size_t> pixels;
  pixels.reserve(static_cast<size_t>(*painted));
  for (const auto& band : bands) pixels.insert(pixels.end(), band.begin(), band.end());
  return pixels;
}

}  // namespace

SelectionCloud MakeCloud(const PosedCamera& view, const std::string& view_name, const Mask& mask,
                         const DepthMap& depth, const Mask& valid, const Image& image,
                         const CloudOptions& options, CloudSummary* summary, Backend* backend) {
  options.Check();
  RequirePinhole(view);
  RequireSize("mask", mask, view.camera);
  RequireSize("depth map", depth, view.camera);
  if (!valid.Empty()) RequireSize("validity mask", valid, view.camera);
  if (!image.Empty()) RequireSize("image", image, view.camera);

  CloudSummary counts;
  const std::vector<size_t> pixels = PixelsWithDepth(mask, depth, &counts.mask_pixels);
  if (counts.mask_pixels == 0) throw InputError("the mask of view " + view_name + " is empty");
  if (pixels.empty()) {
    throw NoDepthError("no pixel of the mask of view " + view_name + " has a depth");
  }

  SelectionCloud cloud;
  cloud.sources = {view_name};
  const double focal = std::sqrt(view.camera.fx() * view.camera.fy());
  const Eigen::Quaterniond world_from_cam = view.cam_from_world.rotation.conjugate();
  const std::vector<size_t> sampled = SamplePixels(pixels, options.sample_fraction, options.seed);
  cloud.points.resize(sampled.size());
  ParallelRanges(int64_t(sampled.size()), kGrain, [&](int64_t begin, int64_t end) {
    for (auto i = size_t(begin); i < size_t(end); ++i) {
      const int x = static_cast<int>(sampled[i] % size_t(mask.width));
      const int y = static_cast<int>(sampled[i] / size_t(mask.width));
      const double z = depth(x, y);
      SelectionPoint& point = cloud.points[i];
      point.position = view.Unproject({x + 0.5, y + 0.5}, z).cast<float>();
      point.normal = (world_from_cam * NormalFromDepth(view.camera, depth, x, y)).cast<float>();
      point.footprint = static_cast<float>(z / focal);
      point.confidence = valid.Empty() || IsInside(valid(x, y)) ? 1.0f : 0.5f;
      point.coverage = static_cast<float>(mask(x, y)) / 255.0f;
      point.x = static_cast<uint16_t>(x);
      point.y = static_cast<uint16_t>(y);
    }
  });
  counts.sampled = static_cast<int64_t>(cloud.points.size());
  DropOutliers(options, backend, &cloud.points);
  counts.kept = static_cast<int64_t>(cloud.points.size());
  if (!image.Empty()) SetColors(image.data.data(), image.width, &cloud);
  if (summary) *summary = counts;
  return cloud;
}

void SetColors(const float* rgb, int width, SelectionCloud* cloud) {
  ParallelRanges(int64_t(cloud->points.size()), kGrain, [&](int64_t begin, int64_t end) {
    for (auto i = size_t(begin); i < size_t(end); ++i) {
      SelectionPoint& point = cloud->points[i];
      const float* const pixel = rgb + 3 * (size_t(point.y) * size_t(width) + point.x);
      for (size_t c = 0; c < 3; ++c) point.color[c] = ToByte(pixel[c]);
    }
  });
}

void Append(SelectionCloud& cloud, SelectionCloud other) {
  if (cloud.points.empty() && cloud.sources.empty()) {
    cloud = std::move(other);
    return;
  }
  std::vector<uint16_t> remapped;
  std::vector<std::string> sources = cloud.sources;
  for (const auto& name : other.sources) {
    const auto found = std::find(sources.begin(), sources.end(), name);
    remapped.push_back(static_cast<uint16_t>(found - sources.begin()));
    if (found == sources.end()) sources.push_back(name);
  }
  if (sources.size() > std::numeric_limits<uint16_t>::max()) {
    throw InputError("a selection cloud holds at most 65535 source views");
  }
  for (auto& point : other.points) {
    if (point.source < remapped.size()) point.source = remapped[point.source];
  }
  cloud.sources = std::move(sources);
  cloud.points.insert(cloud.points.end(), other.points.begin(), other.points.end());
}

int64_t Erase(SelectionCloud& cloud, const PosedCamera& view, const Mask& erase,
              const DepthMap& depth, double depth_tolerance) {
  RequirePinhole(view);
  RequireSize("erase mask", erase, view.camera);
  if (!depth.Empty()) RequireSize("depth map", depth, view.camera);
  CheckOption(depth_tolerance >= 0, "depth tolerance must not be negative");
  const auto erased = [&](const SelectionPoint& point) {
    const auto projected = view.Project(point.position.cast<double>());
    if (!projected) return false;
    const double column = std::floor(projected->x()), row = std::floor(projected->y());
    if (!(column >= 0 && row >= 0 && column < erase.width && row < erase.height)) return false;
    const int x = static_cast<int>(column), y = static_cast<int>(row);
    if (!IsInside(erase(x, y))) return false;
    if (depth.Empty() || !HasDepth(depth, x, y)) return true;
    return projected->z() <= depth(x, y) * (1 + depth_tolerance);
  };
  const auto end = std::remove_if(cloud.points.begin(), cloud.points.end(), erased);
  const int64_t count = cloud.points.end() - end;
  cloud.points.erase(end, cloud.points.end());
  return count;
}

}  // namespace retint
