// SPDX-License-Identifier: BSD-3-Clause
#include "selection/mask_projector.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <string_view>

#include <oneapi/tbb/parallel_for.h>

#include "base/error.h"
#include "selection/depth_sampling.h"
#include "selection/evidence.h"
#include "selection/splat_raster.h"
#include "selection/view_depth.h"

namespace retint {
namespace {

constexpr std::string_view kStage = "projection";
// Of views that are not painted every second row of pixels is lifted: a Gaussian's share is a mean
// over many.
constexpr uint16_t kLiftedRows = 0x5555;

uint8_t ToByte(double value) {
  return static_cast<uint8_t>(std::lround(std::clamp(value, 0.0, 1.0) * 255));
}

Mask ToMask(const ScalarImage& coverage) {
  Mask mask(coverage.width, coverage.height);
  std::transform(coverage.data.begin(), coverage.data.end(), mask.data.begin(), ToByte);
  return mask;
}

// What the views share: depth, drawing, lifting.
class Projection {
 public:
  Projection(const SelectionCloud& cloud, const std::vector<PaintedView>& painted,
             const Reconstruction& reconstruction, Renderer& renderer,
             const ProjectorOptions& options)
      : cloud_(cloud), reconstruction_(reconstruction), renderer_(renderer), options_(options) {
    if (options.kind != ProjectorKind::kGaussians) return;
    for (const auto& view : painted) {
      painted_.push_back({view.name, view.camera, &view.mask,
                          SurfaceDepth(renderer, view.camera, reconstruction.FindView(view.name),
                                       reconstruction)});
    }
    inside_.resize(static_cast<size_t>(renderer.model().count()));
    total_.resize(inside_.size());
    for (const auto& surface : painted_) {
      Lift(surface.camera, PaintedEvidence(*surface.mask, options.painted_weight), kAllPixelRows);
    }
  }

  bool IsPainted(const View& view) const {
    return std::any_of(painted_.begin(), painted_.end(),
                       [&](const PaintedSurface& surface) { return surface.name == view.name; });
  }

  // Quads or surfels as a mask, or, for gaussians, evidence lifted and no mask yet.
  Mask Draw(const View& view) {
    const PosedCamera posed = reconstruction_.Posed(view);
    const bool lifts = options_.kind == ProjectorKind::kGaussians;
    const uint16_t rows = lifts ? kLiftedRows : kAllPixelRows;
    const DepthMap depth = SurfaceDepth(renderer_, posed, &view, reconstruction_, rows);
    if (options_.kind == ProjectorKind::kQuads) {
      return ToMask(
          DrawQuads(cloud_, posed, depth, options_.quad_pixels, options_.depth_tolerance));
    }
    Mask surfels = Close(
        ToMask(DrawSurfels(cloud_, posed, depth, options_.surfel_scale, options_.depth_tolerance)),
        options_.close_radius);
    if (!lifts) return surfels;
    // A cloud alone says nothing of what lies outside it, so all of that counts as outside.
    const double unknown = painted_.empty() ? 1 : options_.unknown_weight;
    Evidence evidence = LookUpPaint(posed, depth, painted_, options_.visible_tolerance, unknown);
    AddCoverage(surfels, &evidence);
    Lift(posed, evidence, rows);
    return {};
  }

  std::vector<float> Shares() const {
    constexpr float kLeastVisible = 1e-6f;  // pixels; below it no view really sees the Gaussian
    std::vector<float> shares(inside_.size());
    for (size_t g = 0; g < shares.size(); ++g) {
      if (total_[g] > kLeastVisible) shares[g] = std::clamp(inside_[g] / total_[g], 0.0f, 1.0f);
    }
    return shares;
  }

 private:
  void Lift(const PosedCamera& posed, const Evidence& evidence, uint16_t rows) {
    residual_.resize(evidence.inside.NumPixels() * 2);
    const float density = static_cast<float>(kTileSize) / static_cast<float>(std::popcount(rows));
    const auto width = static_cast<size_t>(evidence.inside.width);
    tbb::parallel_for(0, evidence.inside.height, [&](int y) {
      const float scale = rows >> (y % kTileSize) & 1 ? density : 0;
      for (size_t i = static_cast<size_t>(y) * width; i < (static_cast<size_t>(y) + 1) * width;
           ++i) {
        const float weight = scale * evidence.weight.data[i];
        residual_[2 * i] = weight * evidence.inside.data[i];
        residual_[2 * i + 1] = weight;
      }
    });
    const auto lifted = renderer_.BlendTransposeToGaussians(posed, residual_, 2, rows);
    for (size_t g = 0; g < inside_.size(); ++g) {
      inside_[g] += lifted[2 * g];
      total_[g] += lifted[2 * g + 1];
    }
  }

  const SelectionCloud& cloud_;
  const Reconstruction& reconstruction_;
  Renderer& renderer_;
  const ProjectorOptions& options_;
  std::vector<PaintedSurface> painted_;
  std::vector<float> inside_, total_;  // [N] W^T (K M), W^T K
  std::vector<float> residual_;
};

void CheckInput(const SelectionCloud& cloud, const std::vector<PaintedView>& painted,
                const std::vector<const View*>& views) {
  if (cloud.points.empty()) throw InputError("the selection is empty: its cloud has no points");
  if (views.empty()) throw InputError("there is no view to project the selection to");
  for (const auto& view : painted) {
    const Camera& camera = view.camera.camera;
    if (view.mask.width == camera.width && view.mask.height == camera.height) continue;
    throw InputError("the mask of view " + view.name + " is " + std::to_string(view.mask.width) +
                     "x" + std::to_string(view.mask.height) + ", the view is " +
                     std::to_string(camera.width) + "x" + std::to_string(camera.height));
  }
}

void Finish(ProjectedMasks* result) {
  bool any = false;
  double sum = 0;
  for (const auto& [name, mask] : result->masks) {
    int64_t inside = 0;
    for (const uint8_t value : mask.data) {
      any |= value >= 128;
      inside += value;
    }
    sum += static_cast<double>(inside) / (255.0 * double(std::max<size_t>(1, mask.NumPixels())));
  }
  if (!any) throw InputError("the selection reaches no view");
  result->mean_coverage = sum / static_cast<double>(result->masks.size());
}

}  // namespace

void ProjectorOptions::Check() const {
  CheckOption(quad_pixels >= 1 && quad_pixels <= 100, "quad size must be in [1, 100] pixels");
  CheckOption(surfel_scale > 0 && surfel_scale <= 100, "surfel scale must be in (0, 100]");
  CheckOption(close_radius >= 0 && close_radius <= 100, "close radius must be in [0, 100] pixels");
  CheckOption(depth_tolerance >= 0 && depth_tolerance <= 1, "depth tolerance must be in [0, 1]");
  CheckOption(share_threshold > 0 && share_threshold < 1, "share threshold must be in (0, 1)");
  CheckOption(painted_weight > 0 && painted_weight <= 1e6, "painted weight must be in (0, 1e6]");
  CheckOption(unknown_weight >= 0 && unknown_weight <= 1, "unknown weight must be in [0, 1]");
  CheckOption(visible_tolerance > 0 && visible_tolerance <= 1,
              "visible tolerance must be in (0, 1]");
}

Mask RenderShares(Renderer& renderer, const PosedCamera& view, const std::vector<float>& shares,
                  const ProjectorOptions& options) {
  const std::vector<float> image = renderer.BlendFeatures(view, shares, 1);
  const double threshold = options.share_threshold;
  const double half = 0.5 * std::min(threshold, 1 - threshold);
  Mask mask(view.camera.width, view.camera.height);
  std::transform(image.begin(), image.end(), mask.data.begin(),
                 [&](float share) { return ToByte(0.5 + 0.5 * (share - threshold) / half); });
  return mask;
}

ProjectedMasks ProjectMasks(const SelectionCloud& cloud, const std::vector<PaintedView>& painted,
                            const Reconstruction& reconstruction,
                            const std::vector<const View*>& views, Renderer& renderer,
                            const ProjectorOptions& options, Monitor& monitor) {
  options.Check();
  CheckInput(cloud, painted, views);
  ProjectedMasks result;
  const bool lifts = options.kind == ProjectorKind::kGaussians;
  const double steps = static_cast<double>(views.size() * (lifts ? 2 : 1));
  double done = 0;
  monitor.Step(kStage, done, steps);
  Projection projection(cloud, painted, reconstruction, renderer, options);
  for (const View* view : views) {
    monitor.Step(kStage, done++, steps);
    if (lifts && projection.IsPainted(*view)) continue;
    Mask mask = projection.Draw(*view);
    if (!lifts) result.masks[view->name] = std::move(mask);
  }
  if (lifts) {
    result.shares = projection.Shares();
    // Backwards: the geometries cached last are those of the last views.
    for (auto view = views.rbegin(); view != views.rend(); ++view) {
      monitor.Step(kStage, done++, steps);
      result.masks[(*view)->name] =
          RenderShares(renderer, reconstruction.Posed(**view), result.shares, options);
    }
  }
  Finish(&result);
  return result;
}

}  // namespace retint
