// SPDX-License-Identifier: BSD-3-Clause
#include "depth/colmap_mvs.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "base/error.h"
#include "base/files.h"
#include "base/median.h"
#include "base/option_name.h"
#include "base/process.h"
#include "base/temporary_folder.h"
#include "colmap_io/image_io.h"
#include "colmap_io/sparse.h"
#include "colmap_io/workspace.h"

namespace retint {
namespace {

namespace fs = std::filesystem;

constexpr const char* kViewName = "view.png";
// The rough depths between which COLMAP searches, and how far beyond them, since they are rough.
constexpr double kNearQuantile = 0.005, kFarQuantile = 0.995, kMargin = 1.3;
// COLMAP passes over the image in four directions, five times.
constexpr int kSweeps = 20;
constexpr size_t kToldLines = 3;
// In degrees: a surface three or four times as far as the median is still measured.
constexpr const char* kSmallestAngle = "1";

struct DepthRange {
  double near = 0, median = 0, far = 0;
};

DepthRange RoughRange(Renderer& renderer, const PosedCamera& view) {
  RenderRequest request;
  request.rgb = false;
  request.depth_median = true;
  std::vector<float> depths = renderer.Render(view, request).depth_median.data;
  std::erase_if(depths, [](float depth) { return !(depth > 0); });
  if (depths.empty()) throw NoDepthError("the view sees no Gaussian, so that it has no depth");
  const auto quantile = [&](double q) { return double(Quantile(depths, q)); };
  return {quantile(kNearQuantile) / kMargin, quantile(0.5), quantile(kFarQuantile) * kMargin};
}

// The view itself first, then the ring around it, all turned as the view is.
std::vector<PosedCamera> Ring(const PosedCamera& view, double median,
                              const ColmapMvsOptions& options) {
  std::vector<PosedCamera> cameras = {view};
  const double radius = median * std::tan(options.angle * std::numbers::pi / 180);
  for (int k = 0; k < options.sources; ++k) {
    const double turn = 2 * std::numbers::pi * k / options.sources;
    cameras.push_back(view);
    // x_in_source = x_in_view - center_of_source_in_view
    cameras.back().cam_from_world.translation -=
        radius * Eigen::Vector3d(std::cos(turn), std::sin(turn), 0);
  }
  return cameras;
}

// A dense workspace as `colmap image_undistorter` leaves it: images, model, and which images are
// matched with which.
void WriteWorkspace(const fs::path& folder, Renderer& renderer,
                    const std::vector<PosedCamera>& cameras, Monitor& monitor, double steps) {
  Reconstruction model;
  const Camera& seen = cameras.front().camera;
  model.cameras[1] =
      Camera::Pinhole(1, seen.width, seen.height, seen.fx(), seen.fy(), seen.cx(), seen.cy());
  std::string sources;
  for (size_t k = 0; k < cameras.size(); ++k) {
    View view;
    view.id = ViewId(k + 1);
    view.name = k == 0 ? kViewName : fmt::format("source{}.png", k);
    view.camera_id = 1;
    view.cam_from_world = cameras[k].cam_from_world;
    RenderRequest request;
    request.cache = k == 0;
    WritePng(folder / "images" / view.name, renderer.Render(cameras[k], request).rgb);
    if (k > 0) sources += (k > 1 ? ", " : "") + view.name;
    model.views[view.id] = std::move(view);
    monitor.Step("depth", double(k + 1), steps);
  }
  WriteReconstructionBinary(folder / "sparse", model);
  for (const char* kind : {"depth_maps", "normal_maps", "consistency_graphs"}) {
    fs::create_directories(folder / "stereo" / kind);
  }
  WriteFile(folder / "stereo/patch-match.cfg", std::string(kViewName) + "\n" + sources + "\n");
}

// `result` says how the program failed.
[[noreturn]] void ThrowFailed(const fs::path& program, const ProcessResult& result) {
  std::string told;
  const size_t count = std::min(kToldLines, result.last_lines.size());
  for (size_t k = result.last_lines.size() - count; k < result.last_lines.size(); ++k) {
    told += (told.empty() ? "" : " / ") + result.last_lines[k];
  }
  if (told.empty()) told = "it printed nothing";
  for (const std::string& line : result.last_lines) {
    if (line.find("requires CUDA") == std::string::npos) continue;
    throw RunError(program.string() +
                   " was built without CUDA, which its patch_match_stereo needs: name another one "
                   "with " +
                   OptionName("colmap_program") +
                   ", or choose another depth method (it said: " + line + ")");
  }
  throw RunError(fmt::format("{} patch_match_stereo ended with exit code {}: {}", program.string(),
                             result.code, told));
}

}  // namespace

void ColmapMvsOptions::Describe(OptionList& list) {
  list.push_back({.name = "sources",
                  .member = &sources,
                  .range = OptionRange::Closed(2, 64),
                  .help = "views rendered around the wanted one"});
  list.push_back({.name = "angle",
                  .member = &angle,
                  .range = OptionRange::AboveTo(0, 45),
                  .help = "between their rays and the view's, at the median depth",
                  .unit = "degrees"});
}

void ColmapMvsOptions::Check() const {
  CheckRanges(*this);
  CheckOption(!program.empty(), "program must be a path or a name");
}

ColmapMvsEstimator::ColmapMvsEstimator(Renderer& renderer, const ColmapMvsOptions& options)
    : renderer_(renderer), options_(options), program_(FindProgram(options.program)) {
  options_.Check();
  CheckOption(!program_.empty(), "depth method colmap-mvs: there is no program '" +
                                     options_.program + "'; " + OptionName("colmap_program") +
                                     " names COLMAP's");
}

DepthEstimate ColmapMvsEstimator::Estimate(const PosedCamera& view, Monitor& monitor) {
  ToCameraParams(view);  // refuses distorted cameras
  const double rendered = options_.sources + 1, steps = rendered + kSweeps + 1;
  monitor.Step("depth", 0, steps);
  const DepthRange range = RoughRange(renderer_, view);
  const TemporaryFolder folder;
  WriteWorkspace(folder.path(), renderer_, Ring(view, range.median, options_), monitor, steps);

  int sweeps = 0;
  const ProcessResult result =
      RunProcess(program_,
                 {"patch_match_stereo", "--workspace_path", folder.path().string(),
                  "--workspace_format", "COLMAP", "--PatchMatchStereo.geom_consistency", "false",
                  "--PatchMatchStereo.filter_min_triangulation_angle", kSmallestAngle,
                  "--PatchMatchStereo.depth_min", fmt::format("{:.9g}", range.near),
                  "--PatchMatchStereo.depth_max", fmt::format("{:.9g}", range.far)},
                 monitor, [&](std::string_view line) {
                   if (line.find("Sweep") == std::string_view::npos) return;
                   sweeps = std::min(sweeps + 1, kSweeps);
                   monitor.Step("depth", rendered + sweeps, steps);
                 });
  if (result.code != 0) ThrowFailed(program_, result);
  const Workspace workspace = Workspace::Open(folder.path());
  if (!workspace.FindDepthMap(workspace.RequireView(kViewName))) {
    throw RunError(program_.string() +
                   " patch_match_stereo ended without an error but left no depth map");
  }
  Monitor quiet;  // a moment's work, whose steps would start from 0 again
  DepthEstimate estimate = ColmapDepthEstimator(workspace, {}, &renderer_).Estimate(view, quiet);
  estimate.method = "colmap-mvs";
  estimate.reason = fmt::format(
      "COLMAP measured {:.1f} % of the pixels, from {} rendered views; the rest is the "
      "Gaussians' depth",
      100 * estimate.valid_fraction, options_.sources);
  monitor.Step("depth", steps, steps);
  return estimate;
}

}  // namespace retint
