// SPDX-License-Identifier: BSD-3-Clause
#include "selection/mask_projector.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>

#include <oneapi/tbb/parallel_for.h>

#include "base/error.h"
#include "selection/depth_sampling.h"
#include "selection/splat_raster.h"
#include "selection/view_depth.h"

namespace retint {
namespace {

Mask ToMask(const ScalarImage& coverage) {
  Mask mask(coverage.width, coverage.height);
  for (size_t i = 0; i < mask.data.size(); ++i) {
    mask.data[i] =
        static_cast<uint8_t>(std::lround(std::clamp(coverage.data[i], 0.0f, 1.0f) * 255.0f));
  }
  return mask;
}

// A painted view with what it sees, to ask whether a point of the world is in the paint.
struct Painted {
  const PaintedView* view;
  DepthMap depth;
};

DepthMap ViewDepth(Renderer& renderer, const PosedCamera& posed, const View* view,
                   const Reconstruction& reconstruction, const ProjectorOptions& options) {
  RenderRequest request;
  request.rgb = false;
  request.depth_expected = !options.median;
  request.depth_median = options.median;
  auto out = renderer.Render(posed, request);
  DepthMap depth = std::move(options.median ? out.depth_median : out.depth_expected);
  if (view) CorrectDepth(FitDepthBias(depth, posed, *view, reconstruction), &depth);
  return depth;
}

// What the painted views say of the surface in each pixel: inside in [0,1], and whether any sees
// it.
struct Labels {
  ScalarImage inside, known;
};

Labels LookBack(const PosedCamera& view, const DepthMap& depth, const std::vector<Painted>& painted,
                const ProjectorOptions& options) {
  Labels labels{ScalarImage(depth.width, depth.height), ScalarImage(depth.width, depth.height)};
  tbb::parallel_for(0, depth.height, [&](int y) {
    for (int x = 0; x < depth.width; ++x) {
      if (!HasDepth(depth, x, y)) continue;
      const Eigen::Vector3d point = view.Unproject({x + 0.5, y + 0.5}, depth(x, y));
      float inside = 0, count = 0;
      for (const auto& source : painted) {
        const auto at = source.view->camera.Project(point);
        if (!at) continue;
        const int i = static_cast<int>(std::floor(at->x())),
                  j = static_cast<int>(std::floor(at->y()));
        if (!source.depth.Contains(i, j) || !HasDepth(source.depth, i, j)) continue;
        if (std::abs(at->z() - source.depth(i, j)) > options.visible_tolerance * at->z()) continue;
        inside += float(source.view->mask(i, j)) / 255.0f;
        count += 1;
      }
      if (count > 0) {
        labels.inside(x, y) = inside / count;
        labels.known(x, y) = 1;
      }
    }
  });
  return labels;
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
}

ProjectedMasks ProjectMasks(const SelectionCloud& cloud, const std::vector<PaintedView>& painted,
                            const Reconstruction& reconstruction,
                            const std::vector<const View*>& views, Renderer& renderer,
                            const ProjectorOptions& options, Monitor& monitor) {
  options.Check();
  ProjectedMasks result;
  std::vector<Painted> seen;
  for (const auto& view : painted) {
    seen.push_back({&view, ViewDepth(renderer, view.camera, reconstruction.FindView(view.name),
                                     reconstruction, options)});
  }
  const size_t count = size_t(renderer.model().count());
  std::vector<float> inside(count), total(count);
  const auto lift = [&](const PosedCamera& posed, const ScalarImage& m, const ScalarImage& k,
                        double weight) {
    std::vector<float> residual(m.NumPixels() * 2);
    for (size_t i = 0; i < m.NumPixels(); ++i) {
      residual[2 * i] = float(weight) * m.data[i] * k.data[i];
      residual[2 * i + 1] = float(weight) * k.data[i];
    }
    const auto shares = renderer.BlendTransposeToGaussians(posed, residual, 2);
    for (size_t g = 0; g < count; ++g) {
      inside[g] += shares[2 * g];
      total[g] += shares[2 * g + 1];
    }
  };
  for (size_t v = 0; v < views.size(); ++v) {
    monitor.Step("projection", double(v), double(views.size()));
    const PosedCamera posed = reconstruction.Posed(*views[v]);
    const auto found = std::find_if(painted.begin(), painted.end(),
                                    [&](const auto& p) { return p.name == views[v]->name; });
    if (options.kind == ProjectorKind::kGaussians && found != painted.end()) {
      ScalarImage m(posed.camera.width, posed.camera.height), k(m.width, m.height, 1.0f);
      for (size_t i = 0; i < m.data.size(); ++i) m.data[i] = float(found->mask.data[i]) / 255.0f;
      lift(posed, m, k, options.painted_weight);
      continue;
    }
    const DepthMap depth = ViewDepth(renderer, posed, views[v], reconstruction, options);
    if (options.kind == ProjectorKind::kQuads) {
      result.masks[views[v]->name] =
          ToMask(DrawQuads(cloud, posed, depth, options.quad_pixels, options.depth_tolerance));
      continue;
    }
    const Mask surfels = Close(
        ToMask(DrawSurfels(cloud, posed, depth, options.surfel_scale, options.depth_tolerance)),
        options.close_radius);
    if (options.kind == ProjectorKind::kSurfels) {
      result.masks[views[v]->name] = surfels;
      continue;
    }
    Labels labels = LookBack(posed, depth, seen, options);
    for (size_t i = 0; i < surfels.data.size(); ++i) {
      const float s = float(surfels.data[i]) / 255.0f;
      float &m = labels.inside.data[i], &k = labels.known.data[i];
      if (options.evidence_mode == 0) m = s, k = 1;
      if (options.evidence_mode == 1) k = k > 0 ? 1 : float(options.unknown_weight);
      if (options.evidence_mode == 2) {
        m = std::max(m, s);
        k = std::max({k, s, float(options.unknown_weight)});
      }
      if (options.evidence_mode == 3) {
        m = s;
        k = std::max({k, s, float(options.unknown_weight)});
      }
    }
    lift(posed, labels.inside, labels.known, 1);
  }
  if (options.kind == ProjectorKind::kGaussians) {
    result.shares.resize(count);
    for (size_t g = 0; g < count; ++g) {
      result.shares[g] = total[g] > 1e-6f ? inside[g] / total[g] : 0;
    }
    for (const View* view : views) {
      const PosedCamera posed = reconstruction.Posed(*view);
      const auto image = renderer.BlendFeatures(posed, result.shares, 1);
      Mask mask(posed.camera.width, posed.camera.height);
      for (size_t i = 0; i < image.size(); ++i) {
        const double value = 0.5 + (image[i] - options.share_threshold) / options.share_threshold;
        mask.data[i] = static_cast<uint8_t>(std::lround(std::clamp(value, 0.0, 1.0) * 255));
      }
      result.masks[view->name] = std::move(mask);
    }
  }
  Finish(&result);
  return result;
}

}  // namespace retint
