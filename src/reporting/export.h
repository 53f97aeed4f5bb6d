// SPDX-License-Identifier: BSD-3-Clause
// The outputs of a session besides its splat: pictures of the edited scene and the report, written
// as StagedOutput does. RunError when they cannot be, Cancelled between pictures.
#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "base/staged_output.h"
#include "editing/edit_session.h"
#include "reporting/report.h"

namespace retint {

// <folder>/<picture name>.png of each picture that shows one of the views, with the coefficients
// `sh`, [N, K, 3].
void ExportViews(EditSession& session, const std::vector<const View*>& views,
                 std::span<const float> sh, const std::filesystem::path& folder, Monitor& monitor);

// <folder>/0000.png, 0001.png, ... along a camera path. `replaced`, frames of an earlier export,
// are removed once all is written, but for those that were written anew.
void ExportFrames(EditSession& session, const std::vector<PosedCamera>& path,
                  std::span<const float> sh, const std::filesystem::path& folder, Monitor& monitor,
                  const std::vector<std::filesystem::path>& replaced = {});

// Whether ExportCameras() may write to `folder`: OptionError where it holds a model or pictures.
// With `overwrite` it may hold an earlier export: sparse/0, all of whose views are named as placed
// ones are, and their pictures in images/, which are returned. Other pictures may lie there too,
// but none whose name is that of a placed view: it would count as a photo of the new ones.
std::vector<std::filesystem::path> CheckCamerasFolder(const std::filesystem::path& folder,
                                                      bool overwrite);

// The views as a COLMAP workspace in `folder`: sparse/0 (cameras, images, points3D) and, where
// `images`, renders of the original scene in images/. `replaced`: as ExportFrames().
void ExportCameras(EditSession& session, bool images, const std::filesystem::path& folder,
                   Monitor& monitor, const std::vector<std::filesystem::path>& replaced = {});

// `frames` cameras on one turn about the axis `up` through `focus`, beginning with `start`; after
// the last comes the first again. OptionError for fewer than one frame or an axis of no length.
std::vector<PosedCamera> OrbitPath(const PosedCamera& start, const Eigen::Vector3d& focus,
                                   const Eigen::Vector3d& up, int frames);

// `frames` cameras on a smooth curve through the views in their order, from the first to the last,
// with the first view's intrinsics. Catmull-Rom interpolates the centers and the quaternions.
// OptionError for fewer than one frame or no view.
std::vector<PosedCamera> ViewPath(const Reconstruction& reconstruction,
                                  const std::vector<const View*>& views, int frames);

// The effect of the edit of one region, fitted or in closed form. It is measured from the result of
// the visible regions before it, so that other regions do not count as bleeding. A hidden region is
// measured as if it were visible. `most_views` as RefitService::Evaluate().
QualityReport EvaluateRegion(EditSession& session, RegionId id, TargetKind target, Monitor& monitor,
                             size_t most_views = 0, int row_step = 1);

// How many of the masks hold a selected pixel, and the mean selected fraction of `views` views, of
// which those without a mask show nothing.
struct Coverage {
  int views = 0;
  double mean = 0;
};
Coverage MeasureCoverage(const std::map<std::string, Mask>& masks, size_t views);

// Backend, counts, times and peaks of the run so far, the last refit's summary and, of a single
// region, its edit. Stages fill in the rest.
RunReport MakeReport(const EditSession& session);
// MakeReport() with the regions: `painted` of all, masks, and EvaluateRegion() of each visible one,
// measured here. `quality` is that of the only visible region, if there is one.
RunReport FullReport(EditSession& session, TargetKind target, Monitor& monitor,
                     size_t most_views = 0, int row_step = 1);
// FullReport() with the options of the fits, as a file: HtmlReport() if its name ends in .html or
// .htm, else ToJson().
void ExportReport(EditSession& session, RefitJob job, const std::filesystem::path& path,
                  Monitor& monitor);

}  // namespace retint
