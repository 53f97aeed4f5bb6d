// SPDX-License-Identifier: BSD-3-Clause
#include "selection/mask_projector.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string_view>
#include <utility>

#include <opencv2/imgproc.hpp>

#include "base/error.h"
#include "base/parallel.h"
#include "render/view_reducer.h"
#include "scene/mask_pixels.h"
#include "selection/depth_agreement.h"
#include "selection/evidence.h"
#include "selection/mask_tools/paint_border.h"
#include "selection/projection_checks.h"
#include "selection/share_renderer.h"
#include "selection/shrunk_view.h"
#include "selection/view_depth.h"

namespace retint {
namespace {

constexpr std::string_view kStage = "projection";
constexpr float kSurfelScale = 1.5f;  // disc radius in footprints
constexpr int kCloseRadius = 2;       // pixels, morphological close of masks of surfels
// Of unpainted views, only every second row of pixels is used, of many views every eighth. The
// share of a Gaussian is a mean over many pixels.
constexpr size_t kManyViews = 32;
uint16_t LiftedRows(size_t views) { return views < kManyViews ? 0x5555 : 0x0101; }
// A relative step in depth of this size makes the border of the paint a silhouette.
constexpr float kSilhouetteJump = 0.005f;
constexpr size_t kCompared = 4;  // number of views to learn from how well the scene's depths agree
// A hand may miss the border by this fraction of the picture's longer side. Farther from the
// border, the paint surely says whether a pixel is selected.
constexpr double kSurePaint = 0.01;
// Lost paint is not put back this close to a mask, in pixels. Its soft border is better there,
// because Gaussians can show it.
constexpr int kBorderOff = 2;
// Lost paint is looked for in all views if a painted view's shares miss more than this of it.
constexpr double kMostLost = 0.01;
constexpr int64_t kGrain = 16384;  // Gaussians

// 255 in pixels at most `reach` rows and columns from a pixel inside.
Mask Widened(const Mask& mask, int reach) {
  Mask wide(mask.width, mask.height);
  cv::Mat inside(mask.height, mask.width, CV_8U);
  for (size_t p = 0; p < mask.data.size(); ++p) inside.data[p] = IsInside(mask.data[p]) ? 255 : 0;
  cv::Mat result(mask.height, mask.width, CV_8U, wide.data.data());
  cv::dilate(inside, result, cv::Mat::ones(2 * reach + 1, 2 * reach + 1, CV_8U));
  return wide;
}

// Shared by the views: the cloud and the painted views in backend memory, and buffers to draw to.
class Projection {
 public:
  Projection(const SelectionCloud& cloud, const std::vector<PaintedView>& painted,
             Renderer& renderer, const ProjectorOptions& options, bool completes,
             ViewReducer& lifted_views)
      : renderer_(renderer),
        backend_(renderer.backend()),
        options_(options),
        completes_(completes),
        lifted_views_(lifted_views) {
    std::vector<CloudPoint> points(cloud.points.size());
    ParallelRanges(int64_t(points.size()), kGrain, [&](int64_t first, int64_t last) {
      std::transform(cloud.points.begin() + first, cloud.points.begin() + last,
                     points.begin() + first, ToCloudPoint);
    });
    points_ = backend_.Upload(std::span<const CloudPoint>(points));
    if (options.kind != ProjectorKind::kGaussians) return;
    const auto count = static_cast<size_t>(renderer.model().count());
    sums_ = backend_.Allocate<float>(SumChannels() * count);
    if (completes) painted_sums_ = backend_.Allocate<float>(count);
    for (const auto& view : painted) {
      painted_.push_back({view.name,
                          view.camera,
                          &view.mask,
                          &view.seen,
                          backend_.Upload(std::span<const uint8_t>(view.mask.data)),
                          {}});
    }
  }

  // The surfaces for AddPainted(), which must come before other views.
  std::vector<SurfaceRequest> PaintedRequests(const Reconstruction& reconstruction) const {
    std::vector<SurfaceRequest> requests;
    for (const Painted& view : painted_) {
      requests.push_back({view.camera, reconstruction.FindView(view.name)});
    }
    return requests;
  }

  void AddPainted(size_t i, ViewSurface surface) {
    Painted& painted = painted_[i];
    const CameraParams& camera = surface.geometry->camera();
    const Mask said = completes_ && options_.paint_slack > 0 ? Said(&painted, surface) : Mask();
    backend_.mask().MarkSilhouette(
        {painted.mask.data(), camera.width, camera.height, kSilhouetteJump, surface.depth.data()});
    HideUnseen(*painted.seen, &surface.depth);
    HideUnseen(said, &surface.depth);
    HideUnseen(Opaque(painted.camera), &surface.depth);
    LiftPaint(surface, painted.mask.data());
    if (completes_) LiftSurePaint(*surface.geometry, painted, said);
    painted.depth = std::move(surface.depth);
  }

  // Compares a view's depths with those of the painted views, for FindTolerance().
  void Compare(const PosedCamera& posed, const ViewSurface& surface) {
    const DepthView view = Downloaded(backend_, posed, surface.depth);
    for (const Painted& painted : painted_) {
      AddDifferences(view, Downloaded(backend_, painted.camera, painted.depth), tolerance_,
                     &differences_);
    }
  }

  // Beside a contact, many depths differ, but by less than visible_tolerance.
  void FindTolerance() {
    tolerance_ = AgreeingTolerance(differences_, tolerance_);
    differences_ = {};
  }

  // Copies the paint into the `mask` of its view.
  void ShowPaint(const View& view, Mask* mask) const {
    for (const Painted& painted : painted_) {
      if (painted.name != view.name) continue;
      const std::vector<uint8_t> paint =
          backend_.Download(painted.mask.data(), painted.mask.size());
      for (size_t p = 0; p < paint.size(); ++p) {
        if (painted.seen->Empty() || painted.seen->data[p] > 0) mask->data[p] = paint[p];
      }
    }
  }

  // Whether the shares show the paint in the painted views, where kMostLost of it may be missing.
  // Other views then show it too.
  bool ShowsPaint(const std::vector<float>& shares, const GaussianGraph* graph) const {
    for (const Painted& painted : painted_) {
      const Mask near =
          Widened(RenderShares(renderer_, painted.camera, shares, options_, graph), kBorderOff);
      size_t all = 0, lost = 0;
      const std::vector<uint8_t> paint =
          backend_.Download(painted.mask.data(), painted.mask.size());
      for (size_t p = 0; p < paint.size(); ++p) {
        if (!IsInside(paint[p]) || (!painted.seen->Empty() && painted.seen->data[p] == 0)) continue;
        ++all;
        lost += near.data[p] == 0 ? 1 : 0;
      }
      if (double(lost) > kMostLost * double(all)) return false;
    }
    return true;
  }

  // Puts paint that the shares lost back into the `mask` of an unpainted view, on surfaces that a
  // painted view surely sees too. Gaussians may be too large or too faint to show it.
  void PutPaintBack(const PosedCamera& posed, const ViewSurface& surface, Mask* mask) {
    const std::vector<PaintedImage> painted = PaintedAsSeenFrom(posed);
    EvidenceParams evidence = LookUp(surface, painted, /*unknown_weight=*/0);
    evidence.tolerance = std::min(evidence.tolerance, kSameSurface);
    evidence.residual = backend_.Grow(residual_, 2 * mask->NumPixels());
    backend_.mask().Evidence(evidence);
    const std::vector<float> found = backend_.Download(evidence.residual, 2 * mask->NumPixels());
    const Mask near = Widened(*mask, kBorderOff);
    ParallelRanges(int64_t(mask->NumPixels()), kGrain, [&](int64_t first, int64_t last) {
      for (auto p = size_t(first); p < size_t(last); ++p) {
        const float inside = found[2 * p], known = found[2 * p + 1];
        if (near.data[p] > 0 || !(known > 0)) continue;
        const auto paint = uint8_t(std::lround(255 * inside / known));
        if (IsInside(paint)) mask->data[p] = paint;
      }
    });
  }

  // Quads or surfels as a mask.
  Mask Draw(const ViewSurface& surface) {
    const CameraParams& camera = surface.geometry->camera();
    DrawCloud(surface, kAllPixelRows, Quads() ? 0 : kCloseRadius);
    Mask mask(camera.width, camera.height);
    backend_.CopyToHost(mask.data.data(), coverage_mask_.data(), mask.data.size());
    return mask;
  }

  // Adds the evidence of an unpainted view to the Gaussians' sums. Each of its pixels counts as
  // `weight`.
  void Lift(const PosedCamera& posed, const ViewSurface& surface, uint16_t pixel_rows,
            float weight) {
    DrawCloud(surface, pixel_rows, 0);
    const std::vector<PaintedImage> painted = PaintedAsSeenFrom(posed);
    // Without paint, the cloud is everything: all pixels outside it count as outside.
    const double unknown = completes_ ? 0 : options_.unknown_weight;
    EvidenceParams evidence =
        LookUp(surface, painted, static_cast<float>(painted.empty() ? 1 : unknown));
    evidence.coverage = coverage_mask_.data();
    evidence.pixel_rows = pixel_rows;
    LiftEvidence(*surface.geometry, evidence, weight);
    if (lifted_views_.AddsInOrder()) {
      KeepLifted(*surface.geometry);
    } else {
      AddLifted(*surface.geometry);
    }
  }

  // Sets the shares of `result`; with completion, also their confidence and visibility.
  void FindShares(const GaussianGraph* graph, Monitor& monitor, ProjectedMasks* result) {
    constexpr float kLeastVisible = 1e-6f;  // pixels; below it no view really sees the Gaussian
    const std::vector<float> sums = SumsOfAllViews();
    const size_t channels = SumChannels(), count = sums.size() / channels;
    const auto channel = [&](size_t c) {
      std::vector<float> values(count);
      ParallelRanges(int64_t(count), kGrain, [&](int64_t first, int64_t last) {
        for (auto g = size_t(first); g < size_t(last); ++g) values[g] = sums[channels * g + c];
      });
      return values;
    };
    if (completes_) {
      const std::vector<float> inside = channel(0), known = channel(1), seen = channel(2);
      const std::vector<float> squared = channel(4);
      result->visible = channel(3);
      const std::vector<float> painted = backend_.Download(painted_sums_.data(), count);
      CompletedShares completed =
          CompleteShares(*graph, {inside, known, seen, painted, result->visible, squared},
                         options_.completion, monitor, &backend_);
      result->shares = std::move(completed.shares);
      result->confidence = std::move(completed.confidence);
      return;
    }
    result->shares.resize(count);
    ParallelRanges(int64_t(count), kGrain, [&](int64_t first, int64_t last) {
      for (auto g = size_t(first); g < size_t(last); ++g) {
        const float inside = sums[channels * g], known = sums[channels * g + 1];
        if (known > kLeastVisible) {
          result->shares[g] = std::clamp(inside / known, 0.0f, 1.0f);
        }
      }
    });
  }

 private:
  struct Painted {
    std::string name;
    PosedCamera camera;
    const Mask* paint;
    const Mask* seen;
    Buffer<uint8_t> mask;  // the paint, moved to the edges that it missed
    Buffer<float> depth;
  };

  static CloudPoint ToCloudPoint(const SelectionPoint& point) {
    CloudPoint out{};
    Eigen::Map<Eigen::Vector3f>(out.position) = point.position;
    Eigen::Map<Eigen::Vector3f>(out.normal) = point.normal;
    out.footprint = point.footprint;
    out.coverage = point.coverage;
    return out;
  }

  std::vector<PaintedImage> PaintedAsSeenFrom(const PosedCamera& posed) const {
    std::vector<PaintedImage> painted;
    for (const auto& view : painted_) {
      painted.push_back(LookedUpFrom(posed, view.camera, view.depth.data(), view.mask.data()));
    }
    return painted;
  }

  EvidenceParams LookUp(const ViewSurface& surface, std::span<const PaintedImage> painted,
                        float unknown_weight) const {
    return {.camera = surface.geometry->camera(),
            .depth = surface.depth.data(),
            .painted = painted,
            .tolerance = tolerance_,
            .unknown_weight = unknown_weight,
            .scale = 1,
            .residual = nullptr};
  }

  bool Quads() const { return options_.kind == ProjectorKind::kQuads; }

  // The cloud's coverage of a view, closed, into coverage_mask_.
  void DrawCloud(const ViewSurface& surface, uint16_t pixel_rows, int close_radius) {
    const CameraParams& camera = surface.geometry->camera();
    backend_.mask().DrawCloud(
        {.camera = camera,
         .points = points_.data(),
         .count = static_cast<int64_t>(points_.size()),
         .square_pixels = Quads() ? static_cast<float>(options_.quad_pixels) : 0,
         .disc_scale = kSurfelScale,
         .depth = surface.depth.data(),
         .depth_tolerance = static_cast<float>(options_.depth_tolerance),
         .coverage = backend_.Grow(coverage_, surface.depth.size()),
         .pixel_rows = pixel_rows});
    backend_.mask().MakeMask({coverage_.data(), camera.width, camera.height, 1, 0, close_radius,
                              backend_.Grow(coverage_mask_, surface.depth.size())});
  }

  // Finds the edges that the paint missed and moves the painted mask to them. Returns 0 in the
  // pixels between paint and edge, of which the paint says nothing, and 255 elsewhere. Empty: there
  // are none.
  Mask Said(Painted* painted, const ViewSurface& surface) {
    Mask mask = *painted->paint;
    ViewLayers layers;
    layers.camera = painted->camera;
    const DeviceRender rendered = renderer_.RenderOnDevice(painted->camera);
    layers.color = Image(mask.width, mask.height);
    layers.color.data = backend_.Download(rendered.rgb.data(), rendered.rgb.size());
    layers.depth = DepthMap(mask.width, mask.height);
    layers.depth.data = backend_.Download(surface.depth.data(), surface.depth.size());
    Monitor quiet;  // part of the projection's own step
    const MissedBorder missed =
        FindMissedBorder(layers, mask, std::max(1, PixelsOf(options_.paint_slack, mask)), quiet);
    if (!AnyInside(missed.left_out) && !AnyInside(missed.spilled)) return {};
    Mask said(mask.width, mask.height, 255);
    for (size_t p = 0; p < mask.data.size(); ++p) {
      if (missed.left_out.data[p] > 0) said.data[p] = 0, mask.data[p] = 255;
      if (missed.spilled.data[p] > 0) said.data[p] = mask.data[p] = 0;
    }
    painted->mask = backend_.Upload(std::span<const uint8_t>(mask.data));
    if (AnyInside(missed.spilled)) DropPoints(painted->camera, missed.spilled, layers.depth);
    return said;
  }

  // Removes the points from the cloud that show in `spilled` pixels, but not the points behind
  // them.
  void DropPoints(const PosedCamera& camera, const Mask& spilled, const DepthMap& depth) {
    std::vector<CloudPoint> points = backend_.Download(points_.data(), points_.size());
    std::erase_if(points, [&](const CloudPoint& point) {
      const Eigen::Vector3f position = Eigen::Map<const Eigen::Vector3f>(point.position);
      const auto at = camera.Project(position.cast<double>());
      if (!at) return false;
      const int x = int(std::floor(at->x())), y = int(std::floor(at->y()));
      if (!spilled.Contains(x, y) || spilled(x, y) == 0) return false;
      return at->z() <= (1 + options_.visible_tolerance) * double(depth(x, y));
    });
    points_ = backend_.Upload(std::span<const CloudPoint>(points));
  }

  // 0 in pixels that show no surface. Nobody means to paint the Gaussians that are faint there.
  Mask Opaque(const PosedCamera& camera) {
    constexpr float kLeastAlpha = 1 / 3.0f;
    const DeviceRender rendered = renderer_.RenderOnDevice(camera, {.rgb = false, .alpha = true});
    const std::vector<float> alpha =
        backend_.Download(rendered.alpha.data(), rendered.alpha.size());
    Mask opaque(rendered.width, rendered.height);
    std::transform(alpha.begin(), alpha.end(), opaque.data.begin(),
                   [](float value) { return value < kLeastAlpha ? 0 : 255; });
    return opaque;
  }

  // Hides pixels that the painter did not see from the evidence.
  void HideUnseen(const Mask& seen, Buffer<float>* depth) {
    if (seen.Empty()) return;
    std::vector<float> on_host = backend_.Download(depth->data(), depth->size());
    for (size_t i = 0; i < on_host.size(); ++i) {
      if (seen.data[i] == 0) on_host[i] = kNoEvidence;
    }
    *depth = backend_.Upload(std::span<const float>(on_host));
  }

  // The paint itself as evidence: M is the paint. K is the same in all pixels, and 0 in hidden
  // ones.
  void LiftPaint(const ViewSurface& surface, const uint8_t* mask) {
    // Every process knows the paint: only the first one adds it.
    LiftEvidence(*surface.geometry, {.camera = surface.geometry->camera(),
                                     .depth = surface.depth.data(),
                                     .unknown_weight = 1,
                                     .coverage = mask,
                                     .scale = static_cast<float>(options_.painted_weight),
                                     .residual = nullptr});
    if (lifted_views_.IsFirst()) AddLifted(*surface.geometry);
  }

  // Adds up the Gaussians in pixels that are far enough from the border of the paint: a hand does
  // not miss it by so much.
  void LiftSurePaint(const ViewGeometry& view, const Painted& painted, const Mask& said) {
    const Mask& paint = *painted.paint;
    std::vector<float> sure = FarFromBorder(paint, PixelsOf(kSurePaint, paint)).data;
    for (size_t p = 0; p < sure.size(); ++p) {
      if (!painted.seen->Empty() && painted.seen->data[p] == 0) sure[p] = 0;
      if (!said.Empty() && said.data[p] == 0) sure[p] = 0;
    }
    const Buffer<float> residual = backend_.Upload(std::span<const float>(sure));
    backend_.blend().BlendTranspose(view,
                                    {.residual = residual.data(),
                                     .channels = 1,
                                     .result = backend_.Grow(lifted_, size_t(view.num_rows()))});
    // Every process adds up all painted views.
    backend_.blend().AddRows(view, lifted_.data(), 1, painted_sums_.data());
  }

  // A fraction of the picture's longer side, in pixels.
  static int PixelsOf(double share, const Mask& paint) {
    return int(std::lround(share * std::max(paint.width, paint.height)));
  }

  size_t Channels() const { return completes_ ? 4 : 2; }
  size_t SumChannels() const { return completes_ ? 5 : 2; }

  // Sets lifted_ to W^T of the evidence; with completion, also to W^T 1.
  void LiftEvidence(const ViewGeometry& view, EvidenceParams evidence, float weight = 1) {
    const size_t pixels = size_t(view.camera().width) * size_t(view.camera().height);
    evidence.residual = backend_.Grow(residual_, Channels() * pixels);
    // Makes up for rows that are not read.
    weight *= kTileSize / static_cast<float>(std::popcount(evidence.pixel_rows));
    evidence.visible = completes_ ? weight : 0;
    evidence.scale *= weight;
    backend_.mask().Evidence(evidence);
    backend_.blend().BlendTranspose(
        view, {.residual = evidence.residual,
               .channels = static_cast<int32_t>(Channels()),
               .result = backend_.Grow(lifted_, Channels() * size_t(view.num_rows())),
               .pixel_rows = evidence.pixel_rows});
  }

  // Adds lifted_ to the sums of the Gaussians.
  void AddLifted(const ViewGeometry& view) {
    backend_.blend().AddRows(view, lifted_.data(), static_cast<int32_t>(Channels()), sums_.data(),
                             completes_);
  }

  // Keeps lifted_ in host memory: sums are made in the order of all views.
  void KeepLifted(const ViewGeometry& view) {
    const size_t channels = Channels();
    ViewRows& rows = kept_.emplace_back();
    for (size_t r = 0; r < static_cast<size_t>(view.num_rows()); ++r) {
      const float* const values = lifted_.data() + channels * r;
      if (std::all_of(values, values + channels, [](float value) { return value == 0; })) continue;
      rows.gaussians.push_back(view.rows()[r]);
      rows.values.insert(rows.values.end(), values, values + channels);
    }
  }

  std::vector<float> SumsOfAllViews() {
    std::vector<float> sums = backend_.Download(sums_.data(), sums_.size());
    lifted_views_.SumRows(kept_, Channels(), /*and_square=*/completes_, &sums);
    kept_.clear();
    return sums;
  }

  Renderer& renderer_;
  Backend& backend_;
  const ProjectorOptions& options_;
  bool completes_;
  float tolerance_ = static_cast<float>(options_.visible_tolerance);
  std::vector<float> differences_;  // relative, of depths within tolerance_
  ViewReducer& lifted_views_;
  std::vector<ViewRows> kept_;  // of own views, not yet added
  Buffer<CloudPoint> points_;
  std::vector<Painted> painted_;
  // [N, 2] W^T (K M), W^T K. With completion [N, 5]: also W^T K without painted_weight, W^T 1, and
  // its square.
  Buffer<float> sums_;
  Buffer<float> painted_sums_;  // [N] W^T 1 of painted views' surely decided pixels
  Buffer<float> coverage_, residual_, lifted_;
  Buffer<uint8_t> coverage_mask_;
};

bool IsPainted(const View& view, const std::vector<PaintedView>& painted) {
  return std::any_of(painted.begin(), painted.end(),
                     [&](const PaintedView& one) { return one.name == view.name; });
}

template <typename T>
std::vector<T> OwnOf(const std::vector<T>& views, const ViewReducer& reducer) {
  std::vector<T> own;
  for (const size_t i : reducer.own()) own.push_back(views[i]);
  return own;
}

double NumPixels(const Camera& camera) { return double(camera.width) * camera.height; }

// Gives every process the masks of `views`, which their owners drew.
void ShareMasks(const Reconstruction& reconstruction, const std::vector<const View*>& views,
                ViewReducer& reducer, std::map<std::string, Mask>* masks) {
  if (!reducer.IsShared()) return;
  for (size_t i = 0; i < views.size(); ++i) {
    Mask& mask = (*masks)[views[i]->name];
    const Camera& camera = reconstruction.Posed(*views[i]).camera;
    if (!reducer.Owns(i)) mask = Mask(camera.width, camera.height);
    reducer.Broadcast(i, BytesOf(std::span(mask.data)));
  }
}

// 1 for each floater, else 0: [N]; empty: there are none.
Buffer<uint8_t> Floaters(const GaussianGraph& graph, Backend& backend) {
  std::vector<uint8_t> floats(graph.NumGaussians());
  bool any = false;
  for (size_t g = 0; g < floats.size(); ++g) any |= floats[g] = graph.Floats(g);
  return any ? backend.Upload(std::span<const uint8_t>(floats)) : Buffer<uint8_t>();
}

}  // namespace

Mask RenderShares(Renderer& renderer, const PosedCamera& view, const std::vector<float>& shares,
                  const ProjectorOptions& options, const GaussianGraph* graph) {
  const auto drawn = ShareRenderer(renderer, shares, options, graph).Render(view);
  Mask mask(view.camera.width, view.camera.height);
  renderer.backend().CopyToHost(mask.data.data(), drawn.data(), drawn.size());
  return mask;
}

ProjectedMasks ProjectMasks(const SelectionCloud& cloud, const std::vector<PaintedView>& painted,
                            const Reconstruction& reconstruction,
                            const std::vector<const View*>& views, Renderer& renderer,
                            const ProjectorOptions& options, Monitor& monitor,
                            const GaussianGraph* graph, const std::vector<const View*>& wanted,
                            const std::vector<PosedCamera>& added) {
  options.Check();
  CheckProjection(cloud, painted, views);
  ProjectedMasks result;
  const bool lifts = options.kind == ProjectorKind::kGaussians;
  const bool completes = graph && options.Completes() && !painted.empty();
  const std::vector<const View*>& all_masked = wanted.empty() ? views : wanted;
  // Views to take evidence from (unpainted ones), or to draw the cloud on.
  struct Drawn {
    PosedCamera posed;
    const View* view;  // null: a view that no camera took
    float weight;      // of a pixel
  };
  std::vector<Drawn> all_drawn;
  for (const View* view : lifts ? views : all_masked) {
    if (lifts && IsPainted(*view, painted)) continue;
    all_drawn.push_back({reconstruction.Posed(*view), view, 1});
  }
  if (completes) {
    for (const PosedCamera& view : added) {
      const PosedCamera shrunk = Shrunk(view);
      const double weight = NumPixels(view.camera) / NumPixels(shrunk.camera);
      all_drawn.push_back({shrunk, nullptr, float(weight)});
    }
  }
  ViewReducer drawn_views(renderer.backend(), all_drawn.size());
  ViewReducer masked_views(renderer.backend(), all_masked.size());
  const std::vector<Drawn> drawn = OwnOf(all_drawn, drawn_views);
  const std::vector<const View*> masked = OwnOf(all_masked, masked_views);
  Projection projection(cloud, painted, renderer, options, completes, drawn_views);
  std::vector<SurfaceRequest> requests = projection.PaintedRequests(reconstruction);
  const size_t num_painted = requests.size();
  const size_t compared = lifts && !painted.empty() ? std::min(kCompared, all_drawn.size()) : 0;
  for (size_t i = 0; i < compared; ++i) {
    const Drawn& one = all_drawn[i * all_drawn.size() / compared];
    requests.push_back({one.posed, one.view, kAllPixelRows, /*cache=*/one.view != nullptr});
  }
  const size_t first_drawn = requests.size();
  const uint16_t pixel_rows = lifts ? LiftedRows(all_drawn.size()) : kAllPixelRows;
  for (const Drawn& one : drawn) {
    requests.push_back({one.posed, one.view, pixel_rows, /*cache=*/one.view != nullptr});
  }
  std::vector<SurfaceRequest> unpainted;  // views of masks that may have lost paint
  for (const View* view : masked) {
    if (lifts && !painted.empty() && !IsPainted(*view, painted)) {
      unpainted.push_back({reconstruction.Posed(*view), view});
    }
  }
  const auto mask_steps = static_cast<double>(masked.size() + unpainted.size());
  // Between two parts of this stage, a completion reports a stage of its own.
  double done = 0, steps = static_cast<double>(2 * drawn.size());
  if (lifts && !completes) steps += mask_steps;
  const auto step = [&] { monitor.Step(kStage, done++, steps); };
  SurfaceOptions surfaces;
  const Buffer<uint8_t> floaters =
      completes ? Floaters(*graph, renderer.backend()) : Buffer<uint8_t>();
  surfaces.left_out = floaters.data();
  surfaces.before_each = [&](size_t i) {
    if (i >= first_drawn) step();
  };
  RenderSurfaces(renderer, reconstruction, requests, surfaces, [&](size_t i, ViewSurface surface) {
    if (i < num_painted) return projection.AddPainted(i, std::move(surface));
    if (i < first_drawn) {
      projection.Compare(requests[i].posed, surface);
      if (i + 1 == first_drawn) projection.FindTolerance();
      return;
    }
    step();
    const Drawn& one = drawn[i - first_drawn];
    if (lifts) {
      projection.Lift(one.posed, surface, pixel_rows, one.weight);
    } else {
      result.masks[one.view->name] = projection.Draw(surface);
    }
  });
  if (lifts) {
    if (completes) {
      monitor.Step(kStage, 1, 1);
      done = 0;
      steps = mask_steps;
    }
    projection.FindShares(graph, monitor, &result);
    RenderMasks(renderer, reconstruction, masked, result.shares, options,
                completes ? graph : nullptr, step, &result.masks);
    for (const View* view : masked) projection.ShowPaint(*view, &result.masks[view->name]);
    if (projection.ShowsPaint(result.shares, completes ? graph : nullptr)) {
      steps -= double(unpainted.size());
      unpainted.clear();
    }
    surfaces.before_each = [&](size_t) { step(); };
    RenderSurfaces(renderer, reconstruction, unpainted, surfaces,
                   [&](size_t i, ViewSurface surface) {
                     projection.PutPaintBack(unpainted[i].posed, surface,
                                             &result.masks[unpainted[i].view->name]);
                   });
  }
  ShareMasks(reconstruction, all_masked, masked_views, &result.masks);
  result.mean_coverage = MeanCoverage(result.masks);
  // A painted view's mask shows its paint in any case. Other views show Gaussians.
  const bool holds = lifts ? HoldsGaussians(result.shares) : HoldsPaint(painted, result);
  if (!painted.empty() && !holds) {
    throw InputError(
        "the selection holds nothing of what was painted: the splat is too faint there");
  }
  return result;
}

}  // namespace retint
