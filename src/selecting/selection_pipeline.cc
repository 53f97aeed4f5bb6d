// SPDX-License-Identifier: BSD-3-Clause
#include "selecting/selection_pipeline.h"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/median.h"
#include "opening/photo_paint.h"
#include "scene/image_checks.h"
#include "scene/mask_pixels.h"
#include "selecting/painted_exchange.h"
#include "selection/lifted_surfaces.h"
#include "selection/views_between.h"

namespace retint {
namespace {

// The result of a painted view in which nothing has a depth.
PaintedPart WithoutDepth(const PaintedView& view, const SelectOptions& options,
                         const std::string& reason) {
  PaintedPart part;
  const Camera& camera = view.camera.camera;
  part.depth.depth = DepthMap(camera.width, camera.height);
  part.depth.valid = Mask(camera.width, camera.height);
  part.depth.method = part.report.depth_method = options.depth_method;
  part.depth.reason = part.report.depth_reason = part.report.registration.reason = reason;
  part.report.view = view.name;
  part.report.outlined_by = view.outlined_by;
  return part;
}

// The paint's box, with the margin that the cloud and its registration look at: `margin` pixels,
// and the window of a matcher around a pixel.
GridRect Around(const Mask& paint, int margin) {
  constexpr int kMatched = 32;
  int left = paint.width, right = 0, top = paint.height, bottom = 0;
  for (int y = 0; y < paint.height; ++y) {
    const auto row = paint.data.begin() + std::ptrdiff_t(paint.Index(0, y));
    const auto is_painted = [](uint8_t value) { return value > 0; };
    const auto first = std::find_if(row, row + paint.width, is_painted);
    if (first == row + paint.width) continue;
    const auto last = std::find_if(std::reverse_iterator(row + paint.width),
                                   std::reverse_iterator(row), is_painted);
    left = std::min(left, int(first - row));
    right = std::max(right, int(last.base() - row));
    top = std::min(top, y);
    bottom = y + 1;
  }
  if (bottom == 0) return {0, 0, paint.width, paint.height};
  const int grown = margin + kMatched;
  left = std::max(0, left - grown);
  top = std::max(0, top - grown);
  right = std::min(paint.width, right + grown);
  bottom = std::min(paint.height, bottom + grown);
  return {left, top, right - left, bottom - top};
}

bool FoundDepth(const PaintedPart& part) { return part.report.cloud.sampled > 0; }

// The photo of which a view shows a part; null for a view of its own.
const DistortedPhoto* WidePhotoOf(const Workspace& workspace, const PaintedView& painted) {
  const View* view = workspace.reconstruction.FindView(painted.name);
  const DistortedPhoto* photo = view ? workspace.PhotoOf(*view) : nullptr;
  return photo && photo->faces.size() > 1 ? photo : nullptr;
}

// NoDepthError for a photo of which no painted part has depth.
void RequireDepthInPhotos(const Workspace& workspace, const std::vector<PaintedView>& views,
                          const std::vector<PaintedPart>& parts) {
  std::set<const DistortedPhoto*> with_depth;
  for (size_t i = 0; i < views.size(); ++i) {
    if (FoundDepth(parts[i])) with_depth.insert(WidePhotoOf(workspace, views[i]));
  }
  for (size_t i = 0; i < views.size(); ++i) {
    if (!FoundDepth(parts[i]) && !with_depth.contains(WidePhotoOf(workspace, views[i]))) {
      throw NoDepthError(parts[i].report.depth_reason);
    }
  }
}

// The median of the points, by axis.
Eigen::Vector3d MiddleOf(const SelectionCloud& cloud) {
  Eigen::Vector3d middle;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    values.reserve(cloud.points.size());
    for (const SelectionPoint& point : cloud.points) {
      values.push_back(double(point.position[axis]));
    }
    middle[axis] = Median(std::move(values));
  }
  return middle;
}

// Views that make up for cameras where these are few. Those of a part are all that see it whole.
std::vector<PosedCamera> AddedViews(const OpenScene& scene, const SelectionCloud& cloud,
                                    const Camera& lens) {
  constexpr size_t kEnough = 24;
  const size_t there = scene.views().size();
  if (there >= kEnough || scene.part() || cloud.points.empty()) return {};
  std::vector<PosedCamera> cameras;
  for (const View* view : scene.views()) cameras.push_back(scene.reconstruction().Posed(*view));
  return ViewsBetween(cameras, MiddleOf(cloud), lens, kEnough - there);
}

}  // namespace

bool MayStandFor(const Mask& own, const Mask& decided) {
  constexpr double kLeast = 0.5, kMost = 1.25;
  const auto area = double(CountInside(own)), now = double(CountInside(decided));
  return now >= kLeast * area && now <= kMost * area;
}

PaintedView SelectionPipeline::Paint(std::string_view view_name, Mask mask) const {
  const View& view = scene_.workspace().RequireView(view_name);
  PaintedView painted{view.name, scene_.reconstruction().Posed(view), std::move(mask)};
  const std::string what = "mask of view " + view.name;
  RequireSize(what, painted.mask, painted.camera.camera);
  if (!AnySet(painted.mask)) throw InputError(what + ": no pixel is selected");
  return painted;
}

DepthEstimate SelectionPipeline::EstimateDepth(const PosedCamera& view,
                                               const SelectOptions& options, Monitor& monitor) {
  return EstimatePart(view, {0, 0, view.camera.width, view.camera.height}, options, monitor);
}

DepthEstimate SelectionPipeline::EstimatePart(const PosedCamera& view, const GridRect& part,
                                              const SelectOptions& options, Monitor& monitor) {
  const StageClock::Lap lap(scene_.clock(), "depth");
  monitor.Step("depth", 0, 1);
  scene_.renderer().SetSh(scene_.original().sh);
  DepthEstimate estimate = MakeDepthEstimator(options.depth_method, scene_.renderer(),
                                              &scene_.workspace(), options.depth)
                               ->EstimatePart(view, part, monitor);
  monitor.Step("depth", 1, 1);
  return estimate;
}

SelectionResult SelectionPipeline::Select(const std::vector<PaintedView>& painted,
                                          const SelectOptions& options, Monitor& monitor) {
  options.Check();
  CheckOption(!painted.empty(), "no view is painted");
  const std::vector<PaintedView> views = OnViews(scene_.workspace(), painted);
  ViewReducer shared(scene_.renderer().backend(), views.size());
  std::vector<PaintedPart> parts(views.size());
  for (const size_t i : shared.own()) {
    try {
      parts[i] = SelectOne(views[i], options, monitor);
    } catch (const NoDepthError& error) {
      // Of a photo that takes several views, pixels without a surface are left out.
      if (!WidePhotoOf(scene_.workspace(), views[i])) throw;
      parts[i] = WithoutDepth(views[i], options, error.what());
    }
  }
  SharePainted(shared, &parts);
  RequireDepthInPhotos(scene_.workspace(), views, parts);
  SelectionResult result;
  for (PaintedPart& part : parts) {
    Append(result.cloud_raw, std::move(part.raw));
    Append(result.cloud, std::move(part.cloud));
    result.depths.push_back(std::move(part.depth));
    result.painted.push_back(std::move(part.report));
  }
  return result;
}

PaintedPart SelectionPipeline::SelectOne(const PaintedView& view, const SelectOptions& options,
                                         Monitor& monitor) {
  PaintedPart part;
  part.report.view = view.name;
  part.report.outlined_by = view.outlined_by;
  part.depth = EstimatePart(view.camera, Around(view.mask, kRegistrationMargin), options, monitor);
  part.report.depth_method = part.depth.method;
  part.report.depth_reason = part.depth.reason;
  part.report.valid_fraction = part.depth.valid_fraction;
  part.cloud = Unproject(view, part.depth, options, &part.raw, &part.report, monitor);
  RegisterCloud(view, part.depth, options, &part.cloud, &part.report, monitor);
  return part;
}

SelectionCloud SelectionPipeline::Unproject(const PaintedView& view, const DepthEstimate& depth,
                                            const SelectOptions& options, SelectionCloud* all_raw,
                                            PaintedReport* report, Monitor& monitor) {
  const StageClock::Lap lap(scene_.clock(), "cloud");
  monitor.Step("cloud", 0, 1);
  Renderer& renderer = scene_.renderer();
  Backend& backend = renderer.backend();
  const DeviceRender rendered = renderer.RenderOnDevice(view.camera);
  // On its way while the points are found.
  const auto arrival = backend.SendToHost(rendered.rgb.data(), rendered.rgb.size() * sizeof(float));
  SelectionCloud cloud = MakeCloud(view.camera, view.name, view.mask, depth.depth, depth.valid, {},
                                   options.cloud, &report->cloud, &backend);
  const auto* const rgb = static_cast<const float*>(arrival->Wait());
  SetColors(rgb, rendered.width, &cloud);
  if (options.keep_raw) {
    CloudOptions raw_options = options.cloud;
    raw_options.outlier_neighbors = 0;
    SelectionCloud raw =
        MakeCloud(view.camera, view.name, view.mask, depth.depth, depth.valid, {}, raw_options);
    SetColors(rgb, rendered.width, &raw);
    Append(*all_raw, std::move(raw));
  }
  monitor.Step("cloud", 1, 1);
  return cloud;
}

void SelectionPipeline::RegisterCloud(const PaintedView& view, const DepthEstimate& depth,
                                      const SelectOptions& options, SelectionCloud* cloud,
                                      PaintedReport* report, Monitor& monitor) {
  if (!options.register_cloud) {
    report->registration.reason = "switched off";
    return;
  }
  const StageClock::Lap lap(scene_.clock(), "registration");
  monitor.Step("registration", 0, 1);
  const Reconstruction& reconstruction = scene_.reconstruction();
  report->registration = Register(*cloud, view.camera, reconstruction.FindView(view.name),
                                  view.mask, depth.depth, reconstruction, options.registration);
  monitor.Step("registration", 1, 1);
}

ProjectedMasks SelectionPipeline::Project(const SelectionCloud& cloud,
                                          const std::vector<PaintedView>& painted,
                                          const ProjectorOptions& options, Monitor& monitor,
                                          const std::vector<const View*>& wanted) {
  options.Check();
  const std::vector<PaintedView> views = OnViews(scene_.workspace(), painted);
  const StageClock::Lap lap(scene_.clock(), "projection");
  const Reconstruction& reconstruction = scene_.reconstruction();
  const bool completes = options.Completes() && !painted.empty();
  const GaussianGraph* graph = completes ? &GraphFor(cloud, options.completion, monitor) : nullptr;
  std::vector<PosedCamera> added;
  if (completes) added = AddedViews(scene_, cloud, views.front().camera.camera);
  if (completes) scene_.renderer().SetSh(scene_.original().sh);  // in which edges are looked for
  ProjectedMasks masks = ProjectMasks(cloud, views, reconstruction, scene_.views(),
                                      scene_.renderer(), options, monitor, graph, wanted, added);
  monitor.Step("projection", 1, 1);
  return masks;
}

SelectionResult SelectionPipeline::Select(SelectionSource& source, Monitor& monitor) {
  SelectionResult result = Select(source.painted, source.select, monitor);
  source.cloud = result.cloud;
  source.reports = result.painted;
  return result;
}

ProjectedMasks SelectionPipeline::Project(const SelectionSource& source, Monitor& monitor) {
  return Project(source.cloud, source.painted, source.projector, monitor);
}

std::map<std::string, Mask> SelectionPipeline::Decide(std::vector<PaintedView> painted,
                                                      const std::vector<const View*>& wanted,
                                                      Monitor& monitor) {
  painted = OnViews(scene_.workspace(), painted);
  for (PaintedView& view : painted) {
    for (size_t p = 0; p < view.seen.data.size(); ++p) {
      if (view.seen.data[p] == 0) view.mask.data[p] = 0;
    }
  }
  SelectOptions options;
  options.depth_method = "gaussian";  // a look ahead: the masks will be selected by in their turn
  const SelectionResult selected = Select(painted, options, monitor);
  ProjectorOptions project;
  project.paint_slack = 0;  // outlines of strokes follow the edges as it is
  return Project(selected.cloud, painted, project, monitor, wanted).masks;
}

const GaussianGraph& SelectionPipeline::GraphFor(const SelectionCloud& cloud, Completion completion,
                                                 Monitor& monitor) {
  std::optional<Eigen::AlignedBox3f> within;
  if (completion == Completion::kNear && scene_.NumGaussians() > kGraphOfWholeScene) {
    std::vector<Eigen::Vector3f> points;
    for (const SelectionPoint& point : cloud.points) points.push_back(point.position);
    within = Surroundings(points);
  }
  if (!graph_ || !graph_->Covers(within)) {
    graph_.reset();  // before the new one takes memory
    LiftedSurfaces lifted = LiftSurfaces(scene_.renderer(), scene_.original(),
                                         scene_.reconstruction(), scene_.views(), monitor);
    graph_ = std::make_unique<GaussianGraph>(scene_.original(), monitor, within, std::move(lifted));
  }
  return *graph_;
}

}  // namespace retint
