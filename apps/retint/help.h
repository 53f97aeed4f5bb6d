// SPDX-License-Identifier: BSD-3-Clause
// Help in tiers: -h shows common flags and examples, --help all flags of a verb, in groups. Options
// without a flag are listed by `retint options`.
#pragma once

#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>

#include "base/option.h"

namespace retint::cli {

inline constexpr const char* kEverywhere = "Every command";  // group of the options of all verbs
inline constexpr const char* kOtherOptions = "Other options";

class HelpFormatter : public CLI::Formatter {
 public:
  void AddEveryday(const CLI::Option* option) { everyday_.insert(option); }
  void SetExamples(const CLI::App* verb, std::vector<std::string> lines) {
    examples_[verb] = std::move(lines);
  }
  const std::vector<std::string>& ExamplesOf(const CLI::App& verb) const;

  // Normal: of -h. All: of --help.
  std::string make_help(const CLI::App* app, std::string name,
                        CLI::AppFormatMode mode) const override;

 private:
  bool HasEveryday(const CLI::App& verb) const;

  std::set<const CLI::Option*> everyday_;
  std::map<const CLI::App*, std::vector<std::string>> examples_;
};

HelpFormatter& HelpOf(const CLI::App& verb);
// -h lists it, too.
inline CLI::Option* Everyday(const CLI::App* verb, CLI::Option* option) {
  HelpOf(*verb).AddEveryday(option);
  return option;
}
// Lines that run as they stand in a folder with the sample of `retint synth`.
inline void AddExamples(const CLI::App* verb, std::vector<std::string> lines) {
  HelpOf(*verb).SetExamples(verb, std::move(lines));
}

// "Share of the mask's pixels, pixels": the help of a described option.
std::string HelpOf(const Option& option);

// "-o, --output FILE"
std::string NameAndType(const CLI::Option& option);
// The description, its default and its range, "Weight of ... (default 0.4, in (0, 8])".
std::string Explained(const CLI::Option& option);
// The words of "TEXT:{auto,cpu,cuda}", if it has some.
std::vector<std::string> ChoicesOf(const CLI::Option& option);
// The options of a verb that have a flag, in the order of help: that of help itself comes last.
std::vector<const CLI::Option*> Flags(const CLI::App& verb);

// "  left   text", the text wrapped beside the left column.
std::string Row(std::string_view left, std::string_view text);

}  // namespace retint::cli
