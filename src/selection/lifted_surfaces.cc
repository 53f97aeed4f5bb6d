// SPDX-License-Identifier: BSD-3-Clause
#include "selection/lifted_surfaces.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>

#include "base/parallel.h"
#include "kernels/backend.h"
#include "selection/mask_tools/surface_edges.h"
#include "selection/shrunk_view.h"

namespace retint {
namespace {

constexpr std::string_view kStage = "completion";
constexpr size_t kMostViews = 24;
constexpr size_t kBatch = 8, kBatchBytes = size_t{256} << 20;  // views in memory at a time
constexpr float kOpaque = 0.5f;         // a less opaque pixel shows no surface
constexpr float kLeastVisible = 1e-6f;  // pixels; below it no view really sees the Gaussian
constexpr float kBehind = 0.3f;         // part of a pixel's light that is left behind its surface
constexpr double kDepthNoise = 0.03;    // relative
// Only every second row of pixels is used: the results are means over many pixels.
constexpr uint16_t kLiftedRows = 0x5555;
// Of each pixel: V, 1, h, h ln D, h (ln D)^2.
constexpr int kChannels = 5;

std::vector<const View*> SpreadOut(const std::vector<const View*>& views) {
  if (views.size() <= kMostViews) return views;
  std::vector<const View*> some;
  for (size_t i = 0; i < kMostViews; ++i) some.push_back(views[i * views.size() / kMostViews]);
  return some;
}

struct ShrunkView {
  PosedCamera posed;
  std::shared_ptr<const ViewGeometry> geometry;
  Buffer<float> depth, behind;     // [H, W] expected depth, and D
  ScalarImage inverse_depth;       // on the host; 0: no surface
  std::vector<float> behind_host;  // [H, W]
  std::vector<float> residual;     // [H, W, kChannels]
};

// Queues the two depths of a view.
ShrunkView Draw(Renderer& renderer, const PosedCamera& posed) {
  ShrunkView view;
  view.posed = Shrunk(posed);
  view.geometry = renderer.Geometry(view.posed, /*cache=*/false);
  const Camera& camera = view.posed.camera;
  const size_t pixels = size_t(camera.width) * size_t(camera.height);
  view.depth = renderer.backend().Allocate<float>(pixels);
  view.behind = renderer.backend().Allocate<float>(pixels);
  renderer.backend().blend().Depth(*view.geometry, {.median = view.behind.data(),
                                                    .expected = view.depth.data(),
                                                    .threshold = kBehind,
                                                    .min_alpha = kOpaque});
  return view;
}

// The kChannels values of each pixel.
void FindResidual(ShrunkView* view) {
  const Camera& camera = view->posed.camera;
  const ScalarImage valleys =
      SurfaceValleys(view->inverse_depth, std::sqrt(camera.fx() * camera.fy()));
  view->residual.resize(kChannels * valleys.data.size());
  for (int y = 0; y < camera.height; ++y) {
    if (!(kLiftedRows >> (y % kTileSize) & 1)) continue;
    for (size_t p = valleys.Index(0, y); p < valleys.Index(0, y + 1); ++p) {
      float* const residual = &view->residual[kChannels * p];
      const float behind = view->behind_host[p];
      residual[0] = valleys.data[p];
      residual[1] = 1;
      if (!(behind > 0)) continue;
      residual[2] = 1;
      residual[3] = std::log(behind);
      residual[4] = residual[3] * residual[3];
    }
  }
}

// Of one Gaussian, summed over the views.
struct Sums {
  float valley = 0, visible = 0, floating = 0, before = 0;

  // `lifted`: [kChannels], from a view at distance `z`.
  void Add(const float* lifted, double z) {
    valley += lifted[0];
    visible += lifted[1];
    const double weight = double(lifted[2]);
    if (!(z > 0) || !(weight > double(kLeastVisible))) return;
    const double own = std::log(z), mean = double(lifted[3]) / weight - own;
    const double square = double(lifted[4]) / weight - own * (2 * double(lifted[3]) / weight - own);
    before += lifted[2];
    if (mean <= 0) return;
    const double noise = kDepthNoise * kDepthNoise;
    floating += float(weight * mean * mean / (std::max(square, mean * mean) + noise));
  }
};

// Applies W^T to the values of a view's pixels, and adds them to its Gaussians' sums.
void Lift(Renderer& renderer, const GaussianModel& model, const ShrunkView& view,
          Buffer<float>* scratch, std::vector<Sums>* sums) {
  Backend& backend = renderer.backend();
  const auto rows = size_t(view.geometry->num_rows());
  const auto residual = backend.Upload(std::span<const float>(view.residual));
  float* const by_row = backend.Grow(*scratch, kChannels * rows);
  backend.blend().BlendTranspose(*view.geometry, {.residual = residual.data(),
                                                  .channels = kChannels,
                                                  .result = by_row,
                                                  .pixel_rows = kLiftedRows});
  const std::vector<float> lifted = backend.Download(by_row, kChannels * rows);
  const std::vector<int32_t> gaussians = backend.Download(view.geometry->rows(), rows);
  ParallelRanges(int64_t(rows), 4096, [&](int64_t first, int64_t last) {
    for (auto r = size_t(first); r < size_t(last); ++r) {
      const auto g = size_t(gaussians[r]);
      const Eigen::Map<const Eigen::Vector3f> mean(&model.means[3 * g]);
      const double z = (view.posed.cam_from_world * mean.cast<double>()).z();
      (*sums)[g].Add(&lifted[kChannels * r], z);
    }
  });
}

}  // namespace

LiftedSurfaces LiftSurfaces(Renderer& renderer, const GaussianModel& model,
                            const Reconstruction& reconstruction,
                            const std::vector<const View*>& views, Monitor& monitor) {
  Backend& backend = renderer.backend();
  const size_t count = model.NumGaussians();
  std::vector<Sums> sums(count);
  Buffer<float> lifted;
  const std::vector<const View*> some = SpreadOut(views);
  for (size_t next = 0; next < some.size();) {
    std::vector<ShrunkView> batch;
    for (size_t bytes = 0; next < some.size() && batch.size() < kBatch && bytes < kBatchBytes;
         ++next) {
      monitor.Step(kStage, double(next), double(some.size()));
      batch.push_back(Draw(renderer, reconstruction.Posed(*some[next])));
      bytes += batch.back().geometry->bytes();
    }
    for (ShrunkView& view : batch) {
      view.inverse_depth = ScalarImage(view.posed.camera.width, view.posed.camera.height);
      view.inverse_depth.data = backend.Download(view.depth.data(), view.depth.size());
      for (float& z : view.inverse_depth.data) z = z > 0 ? 1 / z : 0;
      view.behind_host = backend.Download(view.behind.data(), view.behind.size());
    }
    ParallelTasks(int64_t(batch.size()), [&](int64_t i) { FindResidual(&batch[size_t(i)]); });
    for (const ShrunkView& view : batch) Lift(renderer, model, view, &lifted, &sums);
  }
  monitor.Step(kStage, 1, 1);
  LiftedSurfaces surfaces{std::vector<float>(count, 0), std::vector<float>(count, 0)};
  for (size_t g = 0; g < count; ++g) {
    const Sums& of = sums[g];
    if (of.visible > kLeastVisible) surfaces.valleys[g] = of.valley / of.visible;
    if (of.before > kLeastVisible) surfaces.floating[g] = of.floating / of.before;
  }
  return surfaces;
}

}  // namespace retint
