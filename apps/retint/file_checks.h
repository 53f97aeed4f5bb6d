// SPDX-License-Identifier: BSD-3-Clause
// Whether the files that a verb was given go together.
#pragma once

#include <CLI/CLI.hpp>

#include "base/input_guard.h"

namespace retint::cli {

struct SceneArguments;

// After parsing: OptionError if a verb would write over its input, or two of its files over each
// other, or a report without its extension. Its main output may replace the file that it is made
// from. An option that names a file to write is listed in file_checks.cc; every other FILE counts
// as read. `scene`: of the verb, found; null: it has none. Tells `guard`, which finds the rest as
// files are opened.
void CheckFiles(const CLI::App& verb, const SceneArguments* scene, InputGuard* guard);

}  // namespace retint::cli
