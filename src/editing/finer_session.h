// SPDX-License-Identifier: BSD-3-Clause
// A session of the same scene with finer Gaussians (recolor/finer_gaussians.h), in which paint
// shows its detail.
#pragma once

#include <filesystem>
#include <memory>

#include "editing/edit_session.h"
#include "recolor/finer_gaussians.h"

namespace retint {

struct FinerSession {
  // Of the same workspace, options and views, with all regions and without their fits: the history
  // starts anew. Null where nothing was to be split.
  std::unique_ptr<EditSession> session;
  RefineSummary summary;
};

// Splits large Gaussians inside a region's masks; where the region's edit has paint, those alone
// that take some of it. OptionError for an unknown region and for a scene that was opened in parts.
// Stages: RefineGaussians()'.
Refinement RefineRegion(EditSession& session, RegionId region, const RefineOptions& options,
                        Monitor& monitor);
// A session with Gaussians that RefineRegion() made. `splat`: where to write them, whose file the
// new session then has; empty: they stay in memory. Stage: "save".
std::unique_ptr<EditSession> WithFinerGaussians(const EditSession& session, FinerGaussians finer,
                                                const std::filesystem::path& splat,
                                                Monitor& monitor);
// Both.
FinerSession MakeFinerSession(EditSession& session, RegionId region, const RefineOptions& options,
                              const std::filesystem::path& splat, Monitor& monitor);

// Of what shows of a region's paint in the painted views, the share that is on Gaussians longer
// than 3 pixels (standard deviation). Each Gaussian counts as its opacity times its area there. 0
// without paint.
double PaintOnLargeGaussians(const Region& region, const OpenScene& scene);
// A share above which stripes and letters look torn.
inline constexpr double kMuchPaint = 0.5;

}  // namespace retint
