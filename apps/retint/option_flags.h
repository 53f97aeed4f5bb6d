// SPDX-License-Identifier: BSD-3-Clause
// Described options (base/option.h) as flags of a verb, and presets, which flags given beside them
// override.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

#include "base/option.h"

namespace retint::cli {

class OptionFlags {
 public:
  // Adds a flag to `verb` for each option of the list that has one; what the options name outlives
  // the run. `rename` replaces flags, {from, to}, where a verb calls an option otherwise.
  void Add(CLI::App* verb, const std::string& group, const OptionList& options,
           const std::vector<std::pair<std::string, std::string>>& rename = {});

  // After parsing: gives `options` the values of `preset`, apart from those whose flag was given.
  // Both lists describe options of one type.
  void TakeOver(const OptionList& preset, const OptionList& options) const;

 private:
  bool Given(const std::string& flag) const;

  std::vector<std::pair<std::string, CLI::Option*>> flags_;  // by the option's own name of it
};

}  // namespace retint::cli
