// SPDX-License-Identifier: BSD-3-Clause
#include "retint/usage_fault.h"

#include <algorithm>
#include <string_view>
#include <vector>

#include "base/edit_distance.h"

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

// Words that nothing is known of.
std::string UnknownFault(const CLI::App& app, const std::vector<std::string>& unknown) {
  std::string message = unknown.size() == 1 ? "The following argument was not expected:"
                                            : "The following arguments were not expected:";
  for (const std::string& word : unknown) message += ' ' + word;
  std::vector<std::string> flags;
  for (const CLI::Option* option : VerbOf(app).get_options()) {
    for (const std::string& name : option->get_lnames()) flags.push_back("--" + name);
  }
  const auto flag =
      std::ranges::find_if(unknown, [](const std::string& word) { return word.starts_with("--"); });
  if (flag == unknown.end()) return message;
  return message + Suggestion(flag->substr(0, flag->find('=')), flags);
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
  const bool has_digits_only =
      !value.empty() && value.find_first_not_of("0123456789") == std::string::npos;
  return name + ": '" + value + "' is " +
         (has_digits_only ? "too large"
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
  return "there is no verb '" + word + "'" +
         (suggestion.empty() ? "; retint --help lists them" : suggestion);
}

}  // namespace retint::cli
