// SPDX-License-Identifier: BSD-3-Clause
// Described options (base/option.h) to and from JSON. An option that applies
// to one choice only, to a solver say, stands in an object of that name:
//   {"solver": "mm", "active_threshold": 0.05, "mm": {"iterations": 12, ...}, "adam": {...}}
#pragma once

#include "base/json_node.h"
#include "base/option.h"

namespace retint::json {

Json OptionsJson(const std::vector<OptionSetting>& settings);

// Sets the options that the object holds. A key that is missing leaves the value that the option
// has, so that files of older programs stay readable; keys that no option has are ignored. A key of
// a group is looked for in the object itself too: version 1 of sessions had no groups. Fail() for a
// value of another type or out of range.
void ReadOptions(const Node& node, const OptionList& options);

// Fail() for a key that is no option's and no group's: for files that people write.
void AllowOnlyOptions(const Node& node, const OptionList& options);

}  // namespace retint::json
