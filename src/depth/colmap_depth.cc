// SPDX-License-Identifier: BSD-3-Clause
#include "depth/colmap_depth.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "base/error.h"
#include "base/median.h"
#include "colmap_io/depth_map_io.h"
#include "colmap_io/workspace.h"

namespace retint {
namespace {

constexpr double kSamePlace = 1e-6;  // radians, and shares of the scene's depth
constexpr int kCloseRounds = 2;      // pixels by which small holes are filled from their rim

// The mean of the largest set of candidates that agree; of two as large the nearer.
float Consensus(std::vector<float>& depths, double tolerance) {
  std::sort(depths.begin(), depths.end());
  size_t best_first = 0, best_count = 0;
  for (size_t first = 0; first < depths.size(); ++first) {
    size_t last = first;
    while (last < depths.size() && depths[last] <= depths[first] * (1 + tolerance)) ++last;
    if (last - first > best_count) {
      best_first = first;
      best_count = last - first;
    }
  }
  double inverse = 0;
  for (size_t k = best_first; k < best_first + best_count; ++k) inverse += 1 / depths[k];
  return float(double(best_count) / inverse);
}

// Fills pixels most of whose neighbors are known and lie on one surface.
void CloseSmallHoles(DepthMap& depth, double edge_tolerance) {
  for (int round = 0; round < kCloseRounds; ++round) {
    const DepthMap before = depth;
    for (int y = 0; y < depth.height; ++y) {
      for (int x = 0; x < depth.width; ++x) {
        if (before(x, y) > 0) continue;
        float low = 0, high = 0;
        double inverse = 0;
        int count = 0;
        for (int dy = -1; dy <= 1; ++dy) {
          for (int dx = -1; dx <= 1; ++dx) {
            if (!before.Contains(x + dx, y + dy)) continue;
            const float d = before(x + dx, y + dy);
            if (!(d > 0)) continue;
            low = count ? std::min(low, d) : d;
            high = std::max(high, d);
            inverse += 1 / d;
            ++count;
          }
        }
        if (count >= 5 && high - low <= edge_tolerance * low) depth(x, y) = float(count / inverse);
      }
    }
  }
}

double RotationAngle(const Rigid3d& a, const Rigid3d& b) {
  return a.rotation.normalized().angularDistance(b.rotation.normalized());
}

}  // namespace

ColmapDepthEstimator::ColmapDepthEstimator(const Workspace& workspace,
                                           const ColmapDepthOptions& options, Renderer* fallback)
    : folder_(workspace.depth_map_folder.empty() ? workspace.root / "stereo" / "depth_maps"
                                                 : workspace.depth_map_folder),
      scale_(workspace.depth_scale),
      options_(options),
      fallback_(fallback) {
  options_.Check();
  for (const auto& [id, view] : workspace.reconstruction.views) {
    if (auto path = workspace.FindDepthMap(view)) {
      sources_.push_back({workspace.reconstruction.Posed(view), std::move(*path)});
      ToCameraParams(sources_.back().camera);  // refuses distorted cameras
    }
  }
  if (sources_.empty()) {
    throw InputError(folder_,
                     "no dense depth map of any view; make them with colmap patch_match_stereo "
                     "--workspace_path DENSE");
  }
  for (const auto& [id, point] : workspace.reconstruction.points) points_.push_back(point.xyz);
}

std::vector<const ColmapDepthEstimator::Source*> ColmapDepthEstimator::Rank(const PosedCamera& view,
                                                                            bool* own) const {
  // Distances are measured in the median depth of the sparse points, or, without any, in the
  // distance of the farthest source.
  std::vector<double> depths;
  for (const auto& point : points_) {
    const double z = (view.cam_from_world * point).z();
    if (z > 0) depths.push_back(z);
  }
  double unit = 0;
  if (!depths.empty()) {
    unit = Median(std::move(depths));
  } else {
    for (const Source& source : sources_) {
      unit = std::max(unit, (source.camera.Center() - view.Center()).norm());
    }
  }
  if (!(unit > 0)) unit = 1;

  std::vector<std::pair<double, const Source*>> ranked;
  for (const Source& source : sources_) {
    const double distance = (source.camera.Center() - view.Center()).norm() / unit;
    const double angle = RotationAngle(source.camera.cam_from_world, view.cam_from_world);
    ranked.emplace_back(distance + angle, &source);
  }
  std::stable_sort(ranked.begin(), ranked.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  *own = ranked.front().first < kSamePlace;
  ranked.resize(std::min(ranked.size(), size_t(options_.max_sources) + (*own ? 1 : 0)));
  std::vector<const Source*> result;
  for (const auto& [score, source] : ranked) result.push_back(source);
  return result;
}

DepthEstimate ColmapDepthEstimator::Estimate(const PosedCamera& view, Monitor& monitor) {
  ToCameraParams(view);  // refuses distorted cameras
  monitor.Step("depth", 0, 1);
  bool own = false;
  const auto sources = Rank(view, &own);
  DepthEstimate estimate;
  estimate.method = "colmap";
  estimate.depth = DepthMap(view.camera.width, view.camera.height, 0.0f);
  std::vector<DepthMap> warped;
  for (size_t k = 0; k < sources.size(); ++k) {
    DepthMap map = ReadDepthMap(sources[k]->path);
    if (scale_ != 1) {
      for (float& z : map.data) z = static_cast<float>(z * scale_);
    }
    if (own && k == 0) {
      estimate.depth =
          ResampleDepth(map, sources[k]->camera.camera, view.camera, options_.edge_tolerance);
    } else {
      warped.push_back(WarpDepth(map, sources[k]->camera, view, options_.edge_tolerance));
    }
    monitor.Step("depth", double(k + 1), double(sources.size() + 1));
  }

  const size_t pixels = estimate.depth.NumPixels();
  const auto count_known = [&] {
    return size_t(std::count_if(estimate.depth.data.begin(), estimate.depth.data.end(),
                                [](float d) { return d > 0; }));
  };
  const size_t from_own = count_known();
  std::vector<float> candidates;
  for (size_t i = 0; i < pixels; ++i) {
    if (estimate.depth.data[i] > 0) continue;
    candidates.clear();
    for (const DepthMap& map : warped) {
      if (map.data[i] > 0) candidates.push_back(map.data[i]);
    }
    if (!candidates.empty()) {
      estimate.depth.data[i] = Consensus(candidates, options_.agree_tolerance);
    }
  }
  CloseSmallHoles(estimate.depth, options_.edge_tolerance);
  const size_t known = count_known();
  if (known == 0) {
    throw InputError(folder_, "none of the dense depth maps sees the view");
  }

  estimate.valid = Mask(view.camera.width, view.camera.height, 0);
  for (size_t i = 0; i < pixels; ++i) estimate.valid.data[i] = estimate.depth.data[i] > 0 ? 255 : 0;
  estimate.valid_fraction = double(known) / double(pixels);
  if (fallback_ && known < pixels) {
    RenderRequest request;
    request.rgb = false;
    request.depth_median = true;
    const DepthMap rough = fallback_->Render(view, request).depth_median;
    for (size_t i = 0; i < pixels; ++i) {
      if (!(estimate.depth.data[i] > 0)) estimate.depth.data[i] = rough.data[i];
    }
  }
  char reason[200];
  std::snprintf(reason, sizeof(reason),
                "%.1f %% of the pixels from the view's own map, %.1f %% from %zu warped maps%s",
                100 * double(from_own) / double(pixels),
                100 * double(known - from_own) / double(pixels), warped.size(),
                known == pixels ? ""
                : fallback_     ? ", the rest from the Gaussians"
                                : ", the rest unknown");
  estimate.reason = reason;
  monitor.Step("depth", 1, 1);
  return estimate;
}

}  // namespace retint
