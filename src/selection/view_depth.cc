// SPDX-License-Identifier: BSD-3-Clause
#include "selection/view_depth.h"

#include "base/parallel.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/LU>

namespace retint {
namespace {

constexpr size_t kBatchBytes = size_t{256} << 20;  // depths and geometries held at a time
constexpr size_t kMostViews = 32;
constexpr double kMaxSpread = 0.03;  // of a depth sample's four pixels

// The sparse points that a view observes, as it should see them.
struct SparseDepths {
  std::vector<double> pixels;  // [n, 2]
  std::vector<double> z;       // [n]
};

SparseDepths SparseDepthsOf(const SurfaceRequest& request, const Reconstruction& reconstruction) {
  SparseDepths sparse;
  if (!request.view) return sparse;
  for (const auto& observation : request.view->observations) {
    const auto found = reconstruction.points.find(observation.point_id);
    if (found == reconstruction.points.end()) continue;
    const auto projected = request.posed.Project(found->second.xyz);
    if (!projected) continue;
    sparse.pixels.insert(sparse.pixels.end(), {projected->x(), projected->y()});
    sparse.z.push_back(projected->z());
  }
  return sparse;
}

}  // namespace

DepthBias FitDepthBias(std::span<const double> rendered, std::span<const double> sparse,
                       double max_relative) {
  constexpr int kLeastPoints = 10, kIterations = 20;
  constexpr double kPrior = 0.1;  // of a - 1, and of b times the depth
  constexpr double kLeastNoise = 1e-3;
  struct Pair {
    double rendered, sparse;
  };
  std::vector<Pair> pairs;
  for (size_t i = 0; i < sparse.size(); ++i) {
    if (rendered[i] > 0 && std::abs(rendered[i] - sparse[i]) <= max_relative * sparse[i]) {
      pairs.push_back({rendered[i], sparse[i]});
    }
  }
  DepthBias bias;
  if (static_cast<int>(pairs.size()) < kLeastPoints) return bias;
  bias.points = static_cast<int>(pairs.size());
  std::vector<double> scratch(pairs.size());
  const auto median = [&](auto value) {
    std::transform(pairs.begin(), pairs.end(), scratch.begin(), value);
    const auto middle = scratch.begin() + static_cast<std::ptrdiff_t>(scratch.size() / 2);
    std::nth_element(scratch.begin(), middle, scratch.end());
    return *middle;
  };
  const double depth = median([](const Pair& pair) { return pair.sparse; });
  // Residual (a / z_rendered + b) z_sparse - 1 in the unknowns (a, b * depth).
  const auto residual = [&](const Pair& pair) {
    return (bias.a / pair.rendered + bias.b) * pair.sparse - 1;
  };
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    const double noise = std::max(
        kLeastNoise, 1.4826 * median([&](const Pair& p) { return std::abs(residual(p)); }));
    Eigen::Matrix2d normal = Eigen::Matrix2d::Identity() * (noise / kPrior) * (noise / kPrior);
    Eigen::Vector2d right = normal * Eigen::Vector2d(1, 0);
    for (const auto& pair : pairs) {
      const double r = residual(pair) / noise;
      const double weight = 1 / (1 + r * r);
      const Eigen::Vector2d row(pair.sparse / pair.rendered, pair.sparse / depth);
      normal += weight * row * row.transpose();
      right += weight * row;
    }
    const Eigen::Vector2d solution = normal.inverse() * right;
    bias.a = std::clamp(solution[0], 0.8, 1.25);
    bias.b = std::clamp(solution[1], -0.2, 0.2) / depth;
  }
  return bias;
}

SurfaceRenderer::SurfaceRenderer(Renderer& renderer, const Reconstruction& reconstruction,
                                 std::vector<SurfaceRequest> requests, uint16_t pixel_rows)
    : renderer_(renderer), requests_(std::move(requests)), pixel_rows_(pixel_rows) {
  std::vector<SparseDepths> found(requests_.size());
  ParallelTasks(int64_t(found.size()),
                [&](size_t i) { found[i] = SparseDepthsOf(requests_[i], reconstruction); });
  std::vector<double> pixels;
  sparse_begin_.push_back(0);
  for (const auto& sparse : found) {
    pixels.insert(pixels.end(), sparse.pixels.begin(), sparse.pixels.end());
    sparse_.insert(sparse_.end(), sparse.z.begin(), sparse.z.end());
    sparse_begin_.push_back(sparse_.size());
  }
  pixels_ = renderer.backend().Upload(std::span<const double>(pixels));
  samples_ = renderer.backend().Allocate<double>(sparse_.size());
}

std::vector<ViewSurface> SurfaceRenderer::Next(const std::function<void()>& before_each) {
  constexpr float kOpaque = 0.5f;  // a pixel less opaque than this shows no surface
  Backend& backend = renderer_.backend();
  const size_t first = next_;
  std::vector<ViewSurface> surfaces;
  for (size_t bytes = 0;
       next_ < requests_.size() && surfaces.size() < kMostViews && bytes < kBatchBytes; ++next_) {
    before_each();
    ViewSurface surface;
    surface.geometry = renderer_.Geometry(requests_[next_].posed);
    const CameraParams& camera = surface.geometry->camera();
    surface.depth = backend.Allocate<float>(size_t(camera.width) * size_t(camera.height));
    DepthParams depth{};
    depth.expected = surface.depth.data();
    depth.threshold = 0.5f;
    depth.min_alpha = kOpaque;
    depth.pixel_rows = pixel_rows_;
    backend.blend().Depth(*surface.geometry, depth);
    const size_t begin = sparse_begin_[next_];
    backend.mask().SampleDepth({surface.depth.data(), camera.width, camera.height,
                                pixels_.data() + 2 * begin,
                                int64_t(sparse_begin_[next_ + 1] - begin), kMaxSpread,
                                samples_.data() + begin, pixel_rows_});
    bytes += surface.geometry->bytes() + surface.depth.size() * sizeof(float);
    surfaces.push_back(std::move(surface));
  }
  Correct(first, &surfaces);
  return surfaces;
}

void SurfaceRenderer::Correct(size_t first, std::vector<ViewSurface>* surfaces) {
  const size_t begin = sparse_begin_[first];
  const std::vector<double> samples = renderer_.backend().Download(
      samples_.data() + begin, sparse_begin_[first + surfaces->size()] - begin);
  std::vector<DepthBias> biases(surfaces->size());
  ParallelTasks(int64_t(biases.size()), [&](size_t i) {
    const size_t from = sparse_begin_[first + i], count = sparse_begin_[first + i + 1] - from;
    biases[i] = FitDepthBias(std::span(samples).subspan(from - begin, count),
                             std::span(sparse_).subspan(from, count));
  });
  for (size_t i = 0; i < biases.size(); ++i) {
    const ViewSurface& surface = (*surfaces)[i];
    const CameraParams& camera = surface.geometry->camera();
    renderer_.backend().mask().CorrectDepth({surface.depth.data(), camera.width, camera.height,
                                             float(biases[i].a), float(biases[i].b), pixel_rows_});
  }
}

DepthMap SurfaceDepth(Renderer& renderer, const PosedCamera& posed, const View* view,
                      const Reconstruction& reconstruction) {
  SurfaceRenderer surfaces(renderer, reconstruction, {{posed, view}});
  const ViewSurface surface = surfaces.Next()[0];
  DepthMap depth(posed.camera.width, posed.camera.height);
  depth.data = renderer.backend().Download(surface.depth.data(), surface.depth.size());
  return depth;
}

}  // namespace retint
