// SPDX-License-Identifier: BSD-3-Clause
// The commands of `retint`, as its help lists them.
#pragma once

#include <vector>

#include "retint/common.h"

namespace retint::cli {

struct VerbGroup {
  const char* title;
  // Each adds a subcommand whose parsing sets `action`.
  std::vector<void (*)(CLI::App& app, Globals& globals, Action& action)> verbs;
};

const std::vector<VerbGroup>& VerbGroups();

}  // namespace retint::cli
