// SPDX-License-Identifier: BSD-3-Clause
// Whether a splat and a workspace belong together: do the renders show what the photos show?
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "base/monitor.h"
#include "opening/open_scene.h"

namespace retint {

// SH coefficients that stand for more than 50 times white in a color: ten times those of the
// brightest Gaussian of trained captures. A fit spreads such colors over the Gaussians around
// them. How many Gaussians have one, and the first; `records`, where it is not empty, are the
// model's rows in the file. Empty if there is none.
std::string WarningOfColors(const GaussianModel& model, std::span<const uint32_t> records = {});

struct SceneCheckOptions {
  int max_views = 4;          // rendered and compared, evenly spread
  int longest_side = 400;     // pixels; larger views are compared this small; 0: as they are
  bool strict = false;        // a photo that cannot be read is an InputError, else left out
  double min_psnr = 15;       // dB, median of the compared views
  double min_coverage = 0.5;  // mean opacity, median of the compared views (CoversTooLittle)
  double max_gain = 0.25;     // dB, median of the compared views, by moving renders about
  double max_near = 0.05;     // sparse points nearer than is drawn, median of the compared views
};

struct ViewComparison {
  std::string view;
  // dB, of the render against the photo; NaN without one. Of a photo that takes several views, of
  // the pixels that the splat covers.
  double psnr = 0;
  double coverage = 0;  // mean opacity of the render
  // By how many dB a render gets closer to the photo if it is moved by 1 to 8 % of the longer side:
  // 0 if splat and workspace fit, NaN without a photo. `moved` is the length of that motion,
  // relative to the longer side.
  double gain = 0, moved = 0;
  double near = 0;  // share of its sparse points at z up to kNearPlane; NaN if it has no points
};

struct SceneCheck {
  std::vector<std::string> missing_photos;  // view names
  int views = 0;                            // in the workspace
  std::vector<ViewComparison> comparisons;  // of the views that were rendered
  double median_psnr = 0;                   // NaN if no view has a photo
  double median_coverage = 0;
  double median_gain = 0, median_moved = 0;  // NaN if no view has a photo
  double median_near = 0;                    // NaN if no view has sparse points
  std::string mismatch;               // why splat and workspace seem not to fit; empty: they do
  std::vector<std::string> warnings;  // that and missing photos, one line each, for the user
};

// Whether the splat covers less of the views than min_coverage. If there are photos to compare
// with, the limit is a tenth of that, because a single object covers little of its views.
bool CoversTooLittle(const SceneCheck& check, const SceneCheckOptions& options = {});

// Why the splat seems not to fit the photos of `views`, of which the first options.max_views
// are compared. Empty if it fits, or if there is no photo. The views may show little of the
// scene, so their coverage is not judged. Leaves the original's coefficients in
// scene.renderer().
std::string MismatchIn(OpenScene& scene, const std::vector<const View*>& views,
                       const SceneCheckOptions& options = {});

// The same for pictures by name, of which two are compared: one is rendered in a moment anyway, and
// another is enough to be sure.
std::string MismatchIn(OpenScene& scene, const std::vector<std::string>& pictures);

// "12 of 50 views have no photo, and are fitted to their renders; there is no FILE"; empty if none
// is missing. For a fit whose target is the photos.
std::string WarningOfMissingPhotos(const Workspace& workspace);

// Leaves the original's coefficients in scene.renderer(). Stage: "check".
SceneCheck CheckScene(OpenScene& scene, Monitor& monitor, const SceneCheckOptions& options = {});
// The same of a splat that is opened in parts: `show` hands out a scene with the original's
// coefficients that shows a view, one view after the other.
SceneCheck CheckScene(const Workspace& workspace,
                      const std::function<OpenScene&(const View&)>& show, Monitor& monitor,
                      const SceneCheckOptions& options = {});

}  // namespace retint
