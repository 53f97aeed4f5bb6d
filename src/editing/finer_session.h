// SPDX-License-Identifier: BSD-3-Clause
// A session of the same scene with finer Gaussians (recolor/finer_gaussians.h), in which paint
// shows its detail.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "editing/edit_session.h"
#include "recolor/finer_gaussians.h"

namespace retint {

struct FinerSession {
  // Of the same workspace, options and views, with all regions but without their fits. Its history
  // is empty. Null if there was nothing to split.
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

// A share of paint on large Gaussians above which stripes and letters look torn.
inline constexpr double kMuchPaint = 0.5;

// Which detail the Gaussians let a region's paint have in the painted views. Each counts as its
// opacity times its area there.
struct PaintDetail {
  double on_large = 0;  // the fraction of the visible weight on Gaussians longer than 3 pixels
  double pixels = 0;    // their mean length, standard deviation; 0: there are none
  bool IsTorn() const { return on_large >= kMuchPaint; }
  // For example "97 % of the paint is on Gaussians too large for stripes or letters", and the gain
  // that parts of the default size are expected to bring: "details would be about 7 times as fine".
  std::string Problem() const;
  std::string Gain() const;
};
// Nothing without paint.
PaintDetail DetailOfPaint(const Region& region, const OpenScene& scene);

}  // namespace retint
