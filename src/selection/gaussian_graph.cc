// SPDX-License-Identifier: BSD-3-Clause
#include "selection/gaussian_graph.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <string_view>
#include <utility>

#include "base/error.h"
#include "base/parallel.h"
#include "kernels/common/color_spaces.h"
#include "render/color_encoding.h"
#include "scene/morton.h"
#include "selection/neighbors.h"

namespace retint {
namespace {

constexpr std::string_view kStage = "completion";

// Chosen on two captures, cape and flower; docs/decisions/0003 says what else was tried.
constexpr int kNeighbors = 16;
constexpr double kColorSigma = 0.05;  // OKLab, lightness at half weight
constexpr double kDistanceScale = 2;  // of the two extents
constexpr double kBend = 0.8;  // two flat Gaussians at a right angle lose this part of the weight
constexpr double kLeastWeight = 1e-6;  // keeps the graph connected
constexpr int64_t kGrain = 4096;

GaussianSurface SurfaceOf(const GaussianModel& model, const BaseColors& colors, size_t g) {
  GaussianSurface surface;
  const OkLab lab = OkLabFromSrgb(colors.Of(g).data());
  surface.lab = {lab.lightness, lab.a, lab.b};

  std::array<int, 3> axes = {0, 1, 2};
  const float* const scale = &model.log_scales[3 * g];
  std::sort(axes.begin(), axes.end(), [&](int a, int b) { return scale[a] < scale[b]; });
  surface.mean = Eigen::Vector3f(&model.means[3 * g]);
  surface.extent = std::exp(0.5f * (scale[axes[1]] + scale[axes[2]]));
  surface.flatness = 1 - std::exp(scale[axes[0]] - scale[axes[1]]);
  const float* const q = &model.quats_wxyz[4 * g];
  const Eigen::Quaternionf rotation(q[0], q[1], q[2], q[3]);
  const bool turned = rotation.squaredNorm() > 0;
  surface.normal = turned ? rotation.normalized() * Eigen::Vector3f::Unit(axes[0])
                          : Eigen::Vector3f::Unit(axes[0]).eval();
  return surface;
}

double EdgeWeight(const GaussianSurface& a, const GaussianSurface& b, double distance) {
  Eigen::Vector3d color = (a.lab - b.lab).cast<double>();
  color[0] *= 0.5;
  const double alike = std::exp(-color.squaredNorm() / (2 * kColorSigma * kColorSigma));
  const double extents = std::max(1e-30, double(a.extent) + b.extent);
  const double apart = distance / (kDistanceScale * extents);
  const double angle = 1 - std::min(1.0, double(std::abs(a.normal.dot(b.normal))));
  const double bend = 1 - kBend * a.flatness * b.flatness * angle;
  return std::max(kLeastWeight, alike * bend / (1 + apart * apart));
}

// Joins every node with its nearest ones. An edge is in the rows of both its nodes.
EdgeMatrix Connect(const std::vector<Neighbor>& nearest,
                   const std::vector<GaussianSurface>& surfaces) {
  const size_t count = surfaces.size();
  struct Edge {
    int other;
    float distance;
  };
  std::vector<size_t> begin(count + 1, 0);
  for (size_t i = 0; i < nearest.size(); ++i) {
    if (nearest[i].idx < 0) continue;
    ++begin[i / kNeighbors + 1];
    ++begin[size_t(nearest[i].idx) + 1];
  }
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  std::vector<Edge> edges(begin.back());
  std::vector<size_t> next(begin.begin(), begin.end() - 1);
  for (size_t i = 0; i < nearest.size(); ++i) {
    if (nearest[i].idx < 0) continue;
    const auto a = int(i / kNeighbors);
    edges[next[size_t(a)]++] = {nearest[i].idx, nearest[i].distance};
    edges[next[size_t(nearest[i].idx)]++] = {a, nearest[i].distance};
  }
  // Two nodes that are each other's nearest were joined twice.
  std::vector<size_t> kept(count, 0);
  ParallelRanges(int64_t(count), kGrain, [&](int64_t first, int64_t last) {
    for (auto g = size_t(first); g < size_t(last); ++g) {
      Edge* const row = edges.data() + begin[g];
      Edge* const end = edges.data() + begin[g + 1];
      std::sort(row, end, [](const Edge& a, const Edge& b) { return a.other < b.other; });
      kept[g] = size_t(
          std::unique(row, end, [](const Edge& a, const Edge& b) { return a.other == b.other; }) -
          row);
    }
  });
  EdgeMatrix matrix;
  matrix.begin.assign(count + 1, 0);
  std::partial_sum(kept.begin(), kept.end(), matrix.begin.begin() + 1);
  matrix.other.resize(matrix.begin.back());
  matrix.weight.resize(matrix.begin.back());
  ParallelRanges(int64_t(count), kGrain, [&](int64_t first, int64_t last) {
    for (auto g = size_t(first); g < size_t(last); ++g) {
      for (size_t k = 0; k < kept[g]; ++k) {
        const Edge& edge = edges[begin[g] + k];
        matrix.other[matrix.begin[g] + k] = edge.other;
        matrix.weight[matrix.begin[g] + k] =
            float(EdgeWeight(surfaces[g], surfaces[size_t(edge.other)], edge.distance));
      }
    }
  });
  return matrix;
}

}  // namespace

GaussianGraph::GaussianGraph(const GaussianModel& model, Monitor& monitor,
                             std::optional<Eigen::AlignedBox3f> within, LiftedSurfaces lifted)
    : num_gaussians_(model.NumGaussians()), within_(within), floating_(std::move(lifted.floating)) {
  const std::vector<float>& valleys = lifted.valleys;
  for (const auto* values : {&valleys, &std::as_const(floating_)}) {
    CheckOption(values->empty() || values->size() == num_gaussians_,
                "a graph needs what was lifted of every Gaussian or of none");
  }
  monitor.Step(kStage, 0, 3);
  const auto mean = [&](size_t g) {
    return Eigen::Map<const Eigen::Vector3f>(&model.means[3 * g]);
  };
  for (const uint32_t g : MortonOrder(model.means)) {
    if (!within || within->contains(mean(g))) members_.push_back(int(g));
  }
  const size_t count = members_.size();
  surfaces_.resize(count);
  const BaseColors colors(model);
  std::vector<Eigen::Vector3f> positions(count);
  ParallelRanges(int64_t(count), 1024, [&](int64_t begin, int64_t end) {
    for (auto i = size_t(begin); i < size_t(end); ++i) {
      surfaces_[i] = SurfaceOf(model, colors, GaussianOf(i));
      if (!valleys.empty()) surfaces_[i].valley = valleys[GaussianOf(i)];
      positions[i] = mean(GaussianOf(i));
    }
  });
  monitor.Step(kStage, 1, 3);
  const std::vector<Neighbor> nearest = NearestNeighbors(positions, kNeighbors);
  monitor.Step(kStage, 2, 3);
  edges_ = Connect(nearest, surfaces_);
  monitor.Step(kStage, 3, 3);
}

DeviceEdges GaussianGraph::OnDevice(Backend& backend) const {
  const std::lock_guard lock(mutex_);
  if (device_ != &backend) {
    on_device_ = UploadEdges(edges_, backend);
    device_ = &backend;
  }
  return on_device_;
}

bool GaussianGraph::Covers(const std::optional<Eigen::AlignedBox3f>& box) const {
  return !within_ || (box && within_->contains(*box));
}

Eigen::AlignedBox3f Surroundings(const std::vector<Eigen::Vector3f>& points) {
  Eigen::AlignedBox3f box;
  if (points.empty()) return box;
  std::vector<float> values(points.size());
  const size_t left_out = points.size() / 100;
  for (int axis = 0; axis < 3; ++axis) {
    std::transform(points.begin(), points.end(), values.begin(),
                   [&](const Eigen::Vector3f& point) { return point[axis]; });
    const auto low = values.begin() + std::ptrdiff_t(left_out);
    std::nth_element(values.begin(), low, values.end());
    box.min()[axis] = *low;
    const auto high = values.end() - 1 - std::ptrdiff_t(left_out);
    std::nth_element(values.begin(), high, values.end());
    box.max()[axis] = *high;
  }
  const Eigen::Vector3f reach = Eigen::Vector3f::Constant(2 * box.diagonal().norm());
  return {box.min() - reach, box.max() + reach};
}

}  // namespace retint
