// SPDX-License-Identifier: BSD-3-Clause
#include "selection/lifted_valleys.h"

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

namespace retint {
namespace {

constexpr std::string_view kStage = "completion";
constexpr double kMaxPixels = 100'000;  // as strokes are solved (mask_tools/scribbles.h)
constexpr size_t kMostViews = 24;
constexpr size_t kBatch = 8, kBatchBytes = size_t{256} << 20;  // views held at a time
constexpr float kOpaque = 0.5f;         // a pixel less opaque than this shows no surface
constexpr float kLeastVisible = 1e-6f;  // pixels; below it no view really sees the Gaussian
constexpr int kChannels = 2;            // W^T V, W^T 1

PosedCamera Shrunk(PosedCamera view) {
  Camera& camera = view.camera;
  const double shrink =
      std::min(1.0, std::sqrt(kMaxPixels / (double(camera.width) * camera.height)));
  const int width = std::max(1, int(camera.width * shrink));
  const int height = std::max(1, int(camera.height * shrink));
  const double x = double(width) / camera.width, y = double(height) / camera.height;
  camera = Camera::Pinhole(camera.id, width, height, camera.fx() * x, camera.fy() * y,
                           camera.cx() * x, camera.cy() * y);
  return view;
}

std::vector<const View*> SpreadOut(const std::vector<const View*>& views) {
  if (views.size() <= kMostViews) return views;
  std::vector<const View*> some;
  for (size_t i = 0; i < kMostViews; ++i) some.push_back(views[i * views.size() / kMostViews]);
  return some;
}

struct ShrunkView {
  PosedCamera posed;
  std::shared_ptr<const ViewGeometry> geometry;
  Buffer<float> depth;          // [H, W]
  ScalarImage inverse_depth;    // on the host, 0 where there is none
  std::vector<float> residual;  // [H, W, 2]
};

// Queues the depth of a view.
ShrunkView Draw(Renderer& renderer, const PosedCamera& posed) {
  ShrunkView view;
  view.posed = Shrunk(posed);
  view.geometry = renderer.Geometry(view.posed, /*cache=*/false);
  const Camera& camera = view.posed.camera;
  view.depth = renderer.backend().Allocate<float>(size_t(camera.width) * size_t(camera.height));
  DepthParams params{};
  params.expected = view.depth.data();
  params.threshold = 0.5f;
  params.min_alpha = kOpaque;
  renderer.backend().blend().Depth(*view.geometry, params);
  return view;
}

// The valleys of its depth as what is lifted.
void FindValleys(ShrunkView* view) {
  const Camera& camera = view->posed.camera;
  const ScalarImage valleys =
      SurfaceValleys(view->inverse_depth, std::sqrt(camera.fx() * camera.fy()));
  view->residual.resize(kChannels * valleys.data.size());
  for (size_t p = 0; p < valleys.data.size(); ++p) {
    view->residual[kChannels * p] = valleys.data[p];
    view->residual[kChannels * p + 1] = 1;
  }
}

}  // namespace

std::vector<float> LiftValleys(Renderer& renderer, const Reconstruction& reconstruction,
                               const std::vector<const View*>& views, Monitor& monitor) {
  Backend& backend = renderer.backend();
  const auto count = size_t(renderer.model().count());
  auto sums = backend.Allocate<float>(kChannels * count);
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
    }
    ParallelTasks(int64_t(batch.size()), [&](int64_t i) { FindValleys(&batch[size_t(i)]); });
    for (const ShrunkView& view : batch) {
      const auto residual = backend.Upload(std::span<const float>(view.residual));
      BlendTransposeParams lift{};
      lift.residual = residual.data();
      lift.channels = kChannels;
      lift.result = backend.Grow(lifted, kChannels * size_t(view.geometry->num_rows()));
      backend.blend().BlendTranspose(*view.geometry, lift);
      backend.blend().AddRows(*view.geometry, lifted.data(), kChannels, sums.data());
    }
  }
  const std::vector<float> all = backend.Download(sums.data(), sums.size());
  std::vector<float> valleys(count, 0);
  for (size_t g = 0; g < count; ++g) {
    const float visible = all[kChannels * g + 1];
    if (visible > kLeastVisible) valleys[g] = all[kChannels * g] / visible;
  }
  return valleys;
}

}  // namespace retint
