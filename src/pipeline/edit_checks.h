// SPDX-License-Identifier: BSD-3-Clause
// Checks of a recipe before its long work.
#pragma once

#include "base/input_guard.h"
#include "pipeline/edit_recipe.h"
#include "pipeline/scene_source.h"

namespace retint {

// Before the scene is opened: RunError for outputs that could not be written, OptionError for
// formats that cannot. Of several processes (base/ranks.h) the first asks.
void CheckOutputs(const EditRecipe& recipe);

// OptionError for steps and formats that the opened scene cannot have: a splat in parts, or another
// format's as a streamed SOG.
void CheckSteps(const EditRecipe& recipe, const SceneSource& scene);

// Names all outputs to `inputs`: OptionError if one would replace an input. Only a splat may
// replace the scene's, and masks those of their own region, which are written as they were read.
void PlanOutputs(const EditRecipe& recipe, const SceneSource& scene, InputGuard& inputs);

}  // namespace retint
