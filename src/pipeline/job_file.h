// SPDX-License-Identifier: BSD-3-Clause
// A job file: a recipe (pipeline/edit_recipe.h) as JSON that people and scripts write
// (docs/pipelines.md; its schema is JobSchema()).
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "pipeline/edit_recipe.h"

namespace retint {

// Paths are made absolute. InputError "FILE:LINE: KEY: fault" for text that is not JSON, keys that
// do not exist, values out of range, and files of edits that cannot be read.
// `seed`, where given, takes the place of the job's.
EditRecipe ReadJob(const std::filesystem::path& path, std::optional<uint64_t> seed = std::nullopt);

// The JSON Schema (draft 2020-12) of a job file, made from the same descriptions of options and
// operations that ReadJob() checks against.
std::string JobSchema();

}  // namespace retint
