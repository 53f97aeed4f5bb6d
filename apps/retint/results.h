// SPDX-License-Identifier: BSD-3-Clause
// The outputs of several verbs: stages, pictures, reports.
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "pipeline/edit_run.h"
#include "recolor/finer_gaussians.h"
#include "reporting/format_error.h"
#include "reporting/report.h"
#include "retint/common.h"
#include "scene/gaussian_model.h"
#include "selection/paint_advice.h"

namespace retint::cli {

// A warning for each thing of `model` that the format of `output` has no place for.
void WarnOfLosses(const std::filesystem::path& output, const GaussianModel& model, Run& run);

// Warns if Gaussians were split otherwise than requested.
void WarnOfRefinement(const RefineSummary& summary, const RefineOptions& options, Run& run);

// The two lines of a run that people want: the changes, and their quality. `reach`: see
// VerdictOfPaint(); empty: nothing was painted.
void PrintSummary(const ColorEdit& edit, const RunReport& report, const std::string& reach,
                  const Run& run);
// All figures of `retint recolor`, for --verbose.
void PrintDetails(EditRun& edit, const std::string& reach, const Run& run);

// An edit on this scene: the main colors that it replaces, and the results of the pictures that
// were compared with the scene. Nothing for others.
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

// The error by the format of the written splat, if it rounds.
void PrintFormatError(const std::optional<FormatError>& error, const Run& run);

// The line `look at`: the files that were written, the page first.
void PrintOutputs(const EditOutputs& outputs, const Run& run);

// AdvisePaint() for a region; empty if its masks were not completed, or of Gaussians that were
// split since.
std::optional<PaintAdvice> AdviseOn(EditSession& session, const RegionOutcome& outcome,
                                    Monitor& monitor);
void PrintAdvice(const std::optional<PaintAdvice>& advice, const Run& run);

}  // namespace retint::cli
