// SPDX-License-Identifier: BSD-3-Clause
// Which stages a run will visit, and about how long each takes, for one figure of its progress.
#pragma once

#include <vector>

#include <CLI/CLI.hpp>

#include "base/overall_progress.h"
#include "pipeline/edit_run.h"

namespace retint::cli {

// Of a verb whose options were read. Empty: only the run itself can tell (`retint recolor`, `retint
// run`).
std::vector<PlannedStage> PlanOf(const CLI::App& verb);
// Of a recipe whose scene is open; `stages` are to be done or kept. `evaluates`: the edit is
// measured afterwards.
std::vector<PlannedStage> PlanOf(const EditRecipe& recipe, const std::vector<EditStage>& stages,
                                 bool evaluates);

}  // namespace retint::cli
