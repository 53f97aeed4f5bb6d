// SPDX-License-Identifier: BSD-3-Clause
// Described options (base/option.h) on the command line: a flag for those that people use, --set
// for all. Presets, which typed flags override.
#pragma once

#include <set>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

#include "base/option.h"

namespace retint::cli {

// An option and its stage, "refit": one of the names of `retint options`.
struct StageOption {
  std::string stage;
  Option option;

  // "refit.mm.ridge_rest": any part but the last may be left out.
  std::string FullName() const;
  // Whether "ridge_rest", "mm.ridge_rest" or "refit.ridge_rest" means this one.
  bool IsNamed(std::string_view name) const;
};

// The value as text. OptionError if it is not of the option's kind, or out of range.
void SetFromText(const Option& option, const std::string& text);

class OptionFlags {
 public:
  // The members that the options name outlive the run, and so does this.
  void Add(CLI::App* verb, const std::string& stage, const std::string& group,
           const OptionList& options);

  // After parsing: gives `options` the values of `preset`, apart from those that were typed. Both
  // lists describe options of one type.
  void TakeOver(const OptionList& preset, const OptionList& options) const;
  // Whether an option of a stage was typed.
  bool Sets(const std::string& stage) const { return typed_stages_.contains(stage); }

  // NAME=VALUE, as typed behind `flag`.
  void Set(const std::string& text, const std::string& flag);

 private:
  void AddFlag(CLI::App* verb, const std::string& group, const Option& option);

  std::vector<StageOption> all_;
  std::set<std::pair<std::string, std::string>> typed_;  // where it applies, name
  std::set<std::string> typed_stages_;
};

}  // namespace retint::cli
