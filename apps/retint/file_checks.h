// SPDX-License-Identifier: BSD-3-Clause
// Whether the files that a verb was given go together.
#pragma once

#include <CLI/CLI.hpp>

namespace retint::cli {

// After parsing: OptionError where a verb would write over what it reads, or two of its files over
// each other. Its main output may take the place of what it is made from. An option that names a
// file to write is listed in file_checks.cc; every other FILE counts as read.
void CheckFiles(const CLI::App& verb);

}  // namespace retint::cli
