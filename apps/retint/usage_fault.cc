// SPDX-License-Identifier: BSD-3-Clause
#include "retint/usage_fault.h"

#include <algorithm>
#include <string_view>
#include <vector>

#include "base/edit_distance.h"
#include "retint/common.h"

namespace retint::cli {
namespace {

// "; did you mean --output?", or nothing if no name is much like `word`.
std::string Suggestion(std::string_view word, const std::vector<std::string>& names) {
  constexpr int kMostWrong = 2;  // two letters that are swapped
  const auto distance = [&](const std::string& name) { return EditDistance(word, name); };
  const auto best = std::ranges::min_element(names, {}, distance);
  const bool is_alike = best != names.end() && distance(*best) <= kMostWrong &&
                        2 * distance(*best) < static_cast<int>(word.size());
  return is_alike ? "; did you mean " + *best + "?" : "";
}

const CLI::App& VerbOf(const CLI::App& app) {
  const auto verbs = app.get_subcommands();
  return verbs.empty() ? app : *verbs.front();
}

std::vector<std::string> FlagsOf(const CLI::App& verb) {
  std::vector<std::string> flags;
  for (const CLI::Option* option : verb.get_options()) {
    for (const std::string& name : option->get_lnames()) flags.push_back("--" + name);
  }
  return flags;
}

// "recolor, refit and run": the verbs that have a flag.
std::string VerbsWith(const CLI::App& app, const std::string& flag) {
  std::vector<std::string> verbs;
  for (const CLI::App* verb : app.get_subcommands([](const CLI::App*) { return true; })) {
    if (std::ranges::count(FlagsOf(*verb), flag) > 0) verbs.push_back(verb->get_name());
  }
  std::string text;
  for (size_t i = 0; i < verbs.size(); ++i) {
    text += (i == 0 ? "" : i + 1 < verbs.size() ? ", " : " and ") + verbs[i];
  }
  return text.empty() ? text : text + (verbs.size() == 1 ? " has it" : " have it");
}

// How to go on after a flag that the verb does not have.
std::string FlagAdvice(const CLI::App& app, const std::string& flag) {
  const CLI::App& verb = VerbOf(app);
  if (flag == "--workspace") return "; SCENE is an argument without a flag";
  std::string name = flag.substr(2);
  std::replace(name.begin(), name.end(), '-', '_');
  if (!StageOf(name).empty() && verb.get_option_no_throw("--set")) {
    return "; write --set " + name + "=VALUE";
  }
  const std::string others = VerbsWith(app, flag);
  return others.empty() ? Suggestion(flag, FlagsOf(verb)) : "; " + others;
}

// Words that nothing is known of.
std::string UnknownFault(const CLI::App& app, const std::vector<std::string>& unknown) {
  std::string message = unknown.size() == 1 ? "The following argument was not expected:"
                                            : "The following arguments were not expected:";
  for (const std::string& word : unknown) message += ' ' + word;
  const auto flag =
      std::ranges::find_if(unknown, [](const std::string& word) { return word.starts_with("--"); });
  if (flag == unknown.end()) return message;
  return message + FlagAdvice(app, flag->substr(0, flag->find('=')));
}

// CLI11 says "Could not convert: --views = 1.5".
std::string ConversionFault(const CLI::App& app, const std::string& message) {
  constexpr std::string_view kSaid = "Could not convert: ", kIs = " = ";
  const size_t is = message.find(kIs);
  if (!message.starts_with(kSaid) || is == std::string::npos) return message;
  const std::string name = message.substr(kSaid.size(), is - kSaid.size());
  const std::string value = message.substr(is + kIs.size());
  const CLI::Option* const option = VerbOf(app).get_option_no_throw(name);
  if (!option) return message;
  const bool is_whole = option->get_type_name().find("INT") != std::string::npos;
  const size_t sign = value.starts_with('-') ? 1 : 0;
  const bool has_digits_only =
      value.size() > sign && value.find_first_not_of("0123456789", sign) == std::string::npos;
  return name + ": '" + value + "' is " +
         (has_digits_only ? "out of range"
          : is_whole      ? "not a whole number"
                          : "not a number");
}

// CLI11 says "--seed: At Most 1 required but received 2" of an option that is given twice.
std::string RepetitionFault(const std::string& message) {
  constexpr std::string_view kSaid = ": At Most 1 required but received ";
  const size_t at = message.find(kSaid);
  if (at == std::string::npos) return message;
  return message.substr(0, at) + " is given " + message.substr(at + kSaid.size()) +
         " times; give it once";
}

}  // namespace

std::string UsageFault(const CLI::App& app, const CLI::ParseError& error) {
  switch (static_cast<CLI::ExitCodes>(error.get_exit_code())) {
    case CLI::ExitCodes::ConversionError:
      return ConversionFault(app, error.what());
    case CLI::ExitCodes::ArgumentMismatch:
      return RepetitionFault(error.what());
    // An option that is missing may be one that is misspelled: unknown words are told first, in the
    // order in which they were typed.
    case CLI::ExitCodes::RequiredError:
    case CLI::ExitCodes::ExtrasError: {
      const std::vector<std::string> unknown = app.remaining(true);
      return unknown.empty() ? error.what() : UnknownFault(app, unknown);
    }
    default:
      return error.what();
  }
}

std::string UnknownVerb(const CLI::App& app, const std::string& word) {
  std::vector<std::string> names;
  for (const CLI::App* verb : app.get_subcommands([](const CLI::App*) { return true; })) {
    names.push_back(verb->get_name());
  }
  const std::string suggestion = Suggestion(word, names);
  return "there is no command '" + word + "'" +
         (suggestion.empty() ? "; retint --help lists them" : suggestion);
}

}  // namespace retint::cli
