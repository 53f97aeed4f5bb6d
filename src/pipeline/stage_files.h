// SPDX-License-Identifier: BSD-3-Clause
// Internal to job: the files of the stages in their cache entries. Reading throws InputError for
// whatever is damaged or does not fit the scene.
#pragma once

#include <filesystem>
#include <vector>

#include "base/monitor.h"
#include "editing/edit_session.h"
#include "recolor/finer_gaussians.h"

namespace retint {

// cloud.ply and reports.json: of the stage "select".
void WriteSelected(const std::filesystem::path& folder, const SelectionCloud& cloud,
                   const std::vector<PaintedReport>& reports);
void ReadSelected(const std::filesystem::path& folder, SelectionCloud* cloud,
                  std::vector<PaintedReport>* reports);

// masks/<image name>.png, shares.bin and the selected cloud, of the stage "project". The painted
// views are the job's own and are not kept.
void WriteProjected(const std::filesystem::path& folder, const RegionSelection& selection,
                    Monitor& monitor);
void ReadProjected(const std::filesystem::path& folder, const EditSession& session,
                   RegionSelection* selection);

// refined.json and refined.bin, of the stage "refine": the parts, which a `model` with the
// Gaussians that were split is needed to read.
void WriteRefined(const std::filesystem::path& folder, const Refinement& refined);
Refinement ReadRefined(const std::filesystem::path& folder, const GaussianModel& model);

// fit.json and fit.bin, of the stage "refit". The fit's key is the reader's to set.
void WriteFit(const std::filesystem::path& folder, const RegionFit& fit);
RegionFit ReadFit(const std::filesystem::path& folder, const GaussianModel& model);

}  // namespace retint
