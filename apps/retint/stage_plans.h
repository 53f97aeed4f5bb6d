// SPDX-License-Identifier: BSD-3-Clause
// Which stages a run will visit, and about how long each takes, for one figure of its progress.
#pragma once

#include <vector>

#include <CLI/CLI.hpp>

#include "base/overall_progress.h"
#include "pipeline/run_job.h"

namespace retint::cli {

// Of a verb whose options were read. Empty: only the run itself can tell (`retint run`).
std::vector<PlannedStage> PlanOf(const CLI::App& verb);
// Of a job, `stages` of which are to be done or kept. Its scene is open.
std::vector<PlannedStage> PlanOf(const Job& job, const std::vector<JobStage>& stages);

}  // namespace retint::cli
