// SPDX-License-Identifier: BSD-3-Clause
// The operations of an edit as flags, applied in the order in which they are given.
#pragma once

#include <map>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "recolor/color_edit.h"

namespace retint::cli {

class Run;

class EditFlags {
 public:
  // One flag an operation, --edit for a file of them, --keep-lightness and --strength. The verb
  // outlives this.
  void Add(CLI::App* verb, const std::string& group);
  // The edit that the parsed flags ask for; a file's strength of the whole list is the edit's,
  // unless --strength is given. OptionError for a bad value, and where there is none; InputError
  // for a file. Warns `run` of each part that differs from the request.
  ColorEdit Resolve(Run& run) const;
  // Whether any flag of an edit was given.
  bool Given() const;
  float strength() const { return static_cast<float>(strength_); }

 private:
  const CLI::App* verb_ = nullptr;
  std::map<const CLI::Option*, const ColorOperationType*> types_;  // null: --edit
  std::vector<std::string> files_;
  std::map<std::string, std::vector<std::string>> values_;  // by operation
  std::map<std::string, int> counts_;                       // of those without a value
  std::vector<double> keep_lightness_;
  double strength_ = 1;
  const CLI::Option* strength_flag_ = nullptr;
};

}  // namespace retint::cli
