// SPDX-License-Identifier: BSD-3-Clause
// What several verbs write: stages, pictures, reports.
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "recolor/finer_gaussians.h"
#include "reporting/format_error.h"
#include "reporting/report.h"
#include "retint/common.h"
#include "scene/gaussian_model.h"
#include "selection/paint_advice.h"

namespace retint::cli {

// Everything that recolor hands to its outputs.
struct Recolored {
  EditSession* session = nullptr;
  std::vector<PaintedView> painted;
  SelectionResult selection;
  RegionId region = 0;
  TargetKind target = TargetKind::kRender;
  std::optional<RefineSummary> refined;  // where Gaussians were split
  FloatArray sh_after;
};

// depth.bin, depth.png, cloud_raw.ply, cloud.ply, registration.json, masks/, targets/, result/ in
// `folder`; depths of further painted views as depth/<image name>.bin and .png.
void WriteStages(const std::filesystem::path& folder, const Recolored& result, Run& run);

// Before, mask and after of the painted views and of others spread over those the selection
// reaches, a row each.
Image8 ComparisonPicture(const Recolored& result, Run& run);

// A picture's depth of its views'. A view that has none counts as unknown.
DepthEstimate ComposeDepths(const Pictures& pictures, const UserPicture& picture,
                            const std::map<const View*, DepthEstimate>& depths);

// The depth map as COLMAP writes it, and its picture beside it.
void WriteDepth(const std::filesystem::path& map, const std::filesystem::path& picture,
                const DepthEstimate& depth);

// A warning for each thing of `model` that the format of `output` has no place for.
void WarnOfLosses(const std::filesystem::path& output, const GaussianModel& model, Run& run);

// What went otherwise than it was asked for when Gaussians were split.
void WarnOfRefinement(const RefineSummary& summary, const RefineOptions& options, Run& run);

// HtmlReport() of the session, with the command of this run and what it warned of.
void WritePage(const std::filesystem::path& path, EditSession& session, const RunReport& report,
               Run& run);

// What an edit is on this scene: the main colors that it replaces, and what became of the pictures
// that were compared with the scene. Nothing for others.
void PrintEdit(const ColorEdit& edit, const Run& run);

// A hint where many of the edited colors are none that a screen shows, and nothing is done about
// it.
void PrintOutOfGamut(const ColorEdit& edit, const QualityReport& quality, const Run& run);

// #rrggbb of a display-encoded color.
std::string Hex(std::span<const float> rgb);

// The figures of a quality report in lines for people. `session`: where only some of its views may
// have been measured.
void PrintQuality(const QualityReport& quality, const Run& run,
                  const EditSession* session = nullptr);

// How much of a splat that was opened in parts took part; nothing of others.
void PrintParts(const RunReport& report, const Run& run);

// What the format of the written splat adds, if it rounds.
void PrintFormatError(const std::optional<FormatError>& error, const Run& run);

// AdvisePaint() for a region that was made of `masks`; empty if these were not completed.
std::optional<PaintAdvice> AdviseOn(EditSession& session, RegionId region,
                                    const std::vector<PaintedView>& painted,
                                    const ProjectedMasks& masks, Monitor& monitor);
void PrintAdvice(const std::optional<PaintAdvice>& advice, const Run& run);

// How many views hold a masked pixel, and the mean masked fraction of all.
struct Coverage {
  int views = 0;
  double mean = 0;
};
Coverage MeasureCoverage(const std::map<std::string, Mask>& masks);

}  // namespace retint::cli
