// SPDX-License-Identifier: BSD-3-Clause
// Files that packages install beside the program, made from its own options: the man page and the
// completion of bash.
#pragma once

#include <CLI/CLI.hpp>

namespace retint::cli {

// Adds the verb `manual FORMAT`, which help does not list: it prints the text of retint.1 (man) or
// the script (bash). All other verbs must be there already.
void AddManual(CLI::App& app);

}  // namespace retint::cli
