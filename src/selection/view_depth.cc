// SPDX-License-Identifier: BSD-3-Clause
#include "selection/view_depth.h"

#include "base/median.h"
#include "base/parallel.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/LU>

namespace retint {
namespace {

constexpr size_t kBatchViews = 8;    // per batch; three batches are in work at a time
constexpr double kMaxSpread = 0.03;  // of the four pixels of a depth sample

// The sparse points that a view observes: their pixels and their true depths.
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
    return Median(scratch);
  };
  const double depth = median([](const Pair& pair) { return pair.sparse; });
  // Residual (a / z_rendered + b) z_sparse - 1 of the unknowns (a, b * depth).
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

namespace {

// Views that are drawn together.
struct SurfaceBatch {
  size_t first = 0;  // among the requests
  std::vector<ViewSurface> surfaces;
  Buffer<double> samples;            // [sparse points of its views]
  std::unique_ptr<Arrival> arrival;  // of these
  std::vector<DepthBias> biases;     // [surfaces], once they are known
};

// The steps of RenderSurfaces.
class SurfaceDrawer {
 public:
  SurfaceDrawer(Renderer& renderer, const Reconstruction& reconstruction,
                const std::vector<SurfaceRequest>& requests, const SurfaceOptions& options)
      : renderer_(renderer),
        backend_(renderer.backend()),
        reconstruction_(reconstruction),
        requests_(requests),
        options_(options),
        sparse_(requests.size()),
        pixels_(requests.size()) {}

  // Finds the sparse points of the next views.
  void FindSparse() {
    const size_t first = found_;
    found_ = std::max(found_, std::min(next_ + kBatchViews, requests_.size()));
    ParallelTasks(int64_t(found_ - first), [&](size_t i) {
      sparse_[first + i] = SparseDepthsOf(requests_[first + i], reconstruction_);
    });
    for (size_t i = first; i < found_; ++i) {
      pixels_[i] = backend_.Upload(std::span<const double>(sparse_[i].pixels));
    }
  }

  // Queues the depths of as many views as fit, and the samples at their sparse points.
  SurfaceBatch Draw() {
    FindSparse();
    SurfaceBatch batch;
    batch.first = next_;
    size_t points = 0;
    while (next_ < found_ && batch.surfaces.size() < kBatchViews && HasRoom()) {
      options_.before_each(next_);
      batch.surfaces.push_back(DrawOne(requests_[next_]));
      points += sparse_[next_++].z.size();
    }
    batch.samples = backend_.Allocate<double>(points);
    double* samples = batch.samples.data();
    for (size_t i = 0; i < batch.surfaces.size(); ++i) {
      const ViewSurface& surface = batch.surfaces[i];
      const CameraParams& camera = surface.geometry->camera();
      const size_t count = sparse_[batch.first + i].z.size();
      backend_.mask().SampleDepth({surface.depth.data(), camera.width, camera.height,
                                   pixels_[batch.first + i].data(), int64_t(count), kMaxSpread,
                                   samples, requests_[batch.first + i].pixel_rows});
      samples += count;
    }
    batch.arrival = backend_.SendToHost(batch.samples.data(), points * sizeof(double));
    return batch;
  }

  // Fits the corrections of views whose samples have arrived.
  void Fit(SurfaceBatch* batch) {
    if (batch->surfaces.empty()) return;
    const auto* samples = static_cast<const double*>(batch->arrival->Wait());
    std::vector<std::span<const double>> of_views;
    for (size_t i = 0; i < batch->surfaces.size(); ++i) {
      of_views.emplace_back(samples, sparse_[batch->first + i].z.size());
      samples += of_views[i].size();
    }
    batch->biases.resize(of_views.size());
    ParallelTasks(int64_t(of_views.size()), [&](size_t i) {
      batch->biases[i] = FitDepthBias(of_views[i], sparse_[batch->first + i].z);
    });
  }

  // Queues the corrections, then the work of `visit`.
  void Finish(SurfaceBatch batch, const std::function<void(size_t, ViewSurface)>& visit) {
    for (size_t i = 0; i < batch.surfaces.size(); ++i) {
      ViewSurface& surface = batch.surfaces[i];
      const CameraParams& camera = surface.geometry->camera();
      backend_.mask().CorrectDepth({surface.depth.data(), camera.width, camera.height,
                                    float(batch.biases[i].a), float(batch.biases[i].b),
                                    requests_[batch.first + i].pixel_rows});
      held_bytes_ -= BytesOf(surface);
      sparse_[batch.first + i] = {};
      pixels_[batch.first + i] = {};
      visit(batch.first + i, std::move(surface));
    }
  }

 private:
  static size_t BytesOf(const ViewSurface& surface) {
    return surface.geometry->bytes() + surface.depth.size() * sizeof(float);
  }
  bool HasRoom() const {
    return held_bytes_ == 0 || held_bytes_ + largest_bytes_ <= options_.held_bytes;
  }

  ViewSurface DrawOne(const SurfaceRequest& request) {
    constexpr float kOpaque = 0.5f;  // a less opaque pixel shows no surface
    ViewSurface surface;
    surface.geometry = renderer_.Geometry(request.posed, request.cache);
    const CameraParams& camera = surface.geometry->camera();
    surface.depth = backend_.Allocate<float>(size_t(camera.width) * size_t(camera.height));
    const bool median = options_.median;
    backend_.blend().Depth(*surface.geometry,
                           {.median = median ? surface.depth.data() : nullptr,
                            .expected = median ? nullptr : surface.depth.data(),
                            .threshold = 0.5f,
                            .pixel_rows = request.pixel_rows,
                            .min_alpha = kOpaque,
                            .left_out = options_.left_out,
                            .along_rays = median ? &renderer_.model() : nullptr});
    held_bytes_ += BytesOf(surface);
    largest_bytes_ = std::max(largest_bytes_, BytesOf(surface));
    return surface;
  }

  Renderer& renderer_;
  Backend& backend_;
  const Reconstruction& reconstruction_;
  const std::vector<SurfaceRequest>& requests_;
  const SurfaceOptions& options_;
  size_t found_ = 0, next_ = 0;                // requests with known sparse points; drawn requests
  std::vector<SparseDepths> sparse_;           // [requests], of those in work
  std::vector<Buffer<double>> pixels_;         // their pixels
  size_t held_bytes_ = 0, largest_bytes_ = 0;  // of all surfaces in work; the largest one so far
};

}  // namespace

void RenderSurfaces(Renderer& renderer, const Reconstruction& reconstruction,
                    const std::vector<SurfaceRequest>& requests, const SurfaceOptions& options,
                    const std::function<void(size_t, ViewSurface)>& visit) {
  SurfaceDrawer drawer(renderer, reconstruction, requests, options);
  SurfaceBatch fitted, drawn = drawer.Draw();
  while (!fitted.surfaces.empty() || !drawn.surfaces.empty()) {
    drawer.FindSparse();
    if (drawn.arrival) drawn.arrival->Wait();  // wait here, while the device has other work
    SurfaceBatch next = drawer.Draw();
    drawer.Finish(std::move(fitted), visit);
    if (next.surfaces.empty()) next = drawer.Draw();  // into the memory of a finished one
    drawer.Fit(&drawn);
    fitted = std::move(drawn);
    drawn = std::move(next);
  }
}

DepthMap SurfaceDepth(Renderer& renderer, const PosedCamera& posed, const View* view,
                      const Reconstruction& reconstruction, bool median) {
  DepthMap depth;
  depth.width = posed.camera.width;
  depth.height = posed.camera.height;
  SurfaceOptions options;
  options.median = median;
  RenderSurfaces(
      renderer, reconstruction, {{posed, view}}, options, [&](size_t, ViewSurface surface) {
        depth.data = renderer.backend().Download(surface.depth.data(), surface.depth.size());
      });
  return depth;
}

}  // namespace retint
