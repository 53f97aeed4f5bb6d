// SPDX-License-Identifier: BSD-3-Clause
#include "retint/help.h"

#include <algorithm>
#include <cctype>

namespace retint::cli {
namespace {

constexpr size_t kIndent = 2, kTextColumn = 30, kWidth = 100;
constexpr std::string_view kTurnsOff = "{false}";  // CLI11's mark of --no-around

// "FLOAT:in (0, 8]" is the type and its check.
struct TypeParts {
  std::string type, check;
};

TypeParts PartsOf(const CLI::Option& option) {
  std::string type = option.get_type_name(), check;
  for (const std::string_view plain : {"FLOAT", "INT", "UINT", "TEXT"}) {
    const std::string with = std::string(plain) + ":";
    if (!type.starts_with(with)) continue;
    check = type.substr(with.size());
    type = plain;
    // CLI11 says the type again: "FLOAT in [0 - 1]".
    for (const std::string_view again : {"FLOAT ", "INT ", "UINT "}) {
      if (check.starts_with(again)) check.erase(0, again.size());
    }
  }
  return {std::move(type), std::move(check)};
}

std::string Joined(const std::vector<std::string>& words, const char* separator) {
  std::string joined;
  for (const std::string& word : words) joined += (joined.empty() ? "" : separator) + word;
  return joined;
}

std::string TypeFor(const CLI::Option& option) {
  if (option.get_type_size() == 0) return {};
  const auto choices = ChoicesOf(option);
  const std::string type = PartsOf(option).type;
  if (!choices.empty()) return Joined(choices, "|");
  if (type == "FLOAT") return "NUMBER";
  if (type == "INT" || type == "UINT") return "N";
  return type;
}

// As far as the first clause goes.
std::string Brief(const std::string& text) {
  return text.substr(0, std::min(text.find(". "), text.find("; ")));
}

std::string Usage(const CLI::App& app, const std::string& name) {
  std::string usage = "Usage: " + name;
  if (!app.get_subcommands([](const CLI::App*) { return true; }).empty()) usage += " COMMAND";
  for (const CLI::Option* option : app.get_options()) {
    if (!option->get_positional()) continue;
    const std::string label = option->get_name(true, false);
    const bool is_many = option->get_expected_max() > 1;
    usage += (option->get_required() ? " " + label : " [" + label + "]") + (is_many ? "..." : "");
  }
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_positional() || !option->get_required()) continue;
    usage += " " + option->get_name() + " " + TypeFor(*option);
  }
  return usage + " [OPTION]...\n";
}

std::string VerbsOf(const CLI::App& app) {
  std::string text;
  std::string group;
  for (const CLI::App* verb : app.get_subcommands([](const CLI::App*) { return true; })) {
    if (verb->get_group().empty()) continue;
    if (verb->get_group() != group) text += "\n" + verb->get_group() + ":\n";
    group = verb->get_group();
    text += Row(verb->get_name(), verb->get_description());
  }
  return text;
}

// The options of all verbs, which the top of the program lists.
std::string EverywhereOf(const CLI::App& app) {
  const auto verbs = app.get_subcommands([](const CLI::App*) { return true; });
  if (verbs.empty()) return {};
  std::string text = "\n" + std::string(kEverywhere) + " takes:\n";
  for (const CLI::Option* option : Flags(*verbs.front())) {
    if (option->get_group() == kEverywhere) text += Row(NameAndType(*option), Explained(*option));
  }
  return text;
}

}  // namespace

HelpFormatter& HelpOf(const CLI::App& verb) {
  return *std::static_pointer_cast<HelpFormatter>(verb.get_formatter());
}

std::string HelpOf(const Option& option) {
  std::string help = option.help + (option.unit.empty() ? "" : ", in " + option.unit);
  help[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(help[0])));
  return help;
}

std::vector<std::string> ChoicesOf(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const size_t open = type.find('{'), close = type.find('}');
  std::vector<std::string> words;
  if (open == std::string::npos || close == std::string::npos) return words;
  std::string word;
  for (const char c : type.substr(open + 1, close - open)) {
    if (c != ',' && c != '}') {
      word += c;
      continue;
    }
    words.push_back(word);
    word.clear();
  }
  return words;
}

std::string NameAndType(const CLI::Option& option) {
  std::string name;
  if (option.get_positional()) {
    name = option.get_name(true, false);
  } else {
    const auto add = [&](const std::string& one) { name += (name.empty() ? "" : ", ") + one; };
    for (const std::string& one : option.get_snames()) add("-" + one);
    for (const std::string& one : option.get_lnames()) add("--" + one);
    if (const size_t at = name.find(kTurnsOff); at != std::string::npos) {
      name.erase(at, kTurnsOff.size());
    }
    const std::string type = TypeFor(option);
    if (!type.empty()) name += " " + type;
  }
  return name;
}

std::string Explained(const CLI::Option& option) {
  std::vector<std::string> notes;
  const std::string standard = option.get_default_str();
  const bool is_set = !standard.empty() && standard != "\"\"" && standard != "[]";
  if (is_set && option.get_type_size() != 0) notes.push_back("default " + standard);
  const std::string check = PartsOf(option).check;
  if (!check.empty() && ChoicesOf(option).empty()) notes.push_back(check);
  if (notes.empty()) return option.get_description();
  return option.get_description() + " (" + Joined(notes, "; ") + ")";
}

std::vector<const CLI::Option*> Flags(const CLI::App& verb) {
  std::vector<const CLI::Option*> flags, help;
  for (const CLI::Option* option : verb.get_options()) {
    if (option->get_positional()) continue;
    const bool is_help = option == verb.get_help_ptr() || option == verb.get_help_all_ptr();
    (is_help ? help : flags).push_back(option);
  }
  flags.insert(flags.end(), help.begin(), help.end());
  return flags;
}

std::string Row(std::string_view left, std::string_view text) {
  std::string row(kIndent, ' ');
  row += left;
  size_t column = row.size();
  const auto new_line = [&] {
    row += "\n" + std::string(kTextColumn, ' ');
    column = kTextColumn;
  };
  if (column + 2 > kTextColumn) {
    new_line();
  } else {
    row += std::string(kTextColumn - column, ' ');
    column = kTextColumn;
  }
  bool is_first = true;
  while (!text.empty()) {
    const size_t end = std::min(text.find(' '), text.size());
    const std::string_view word = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (!is_first && column + 1 + word.size() > kWidth) {
      new_line();
    } else if (!is_first) {
      row += ' ';
      ++column;
    }
    row += word;
    column += word.size();
    is_first = false;
  }
  return row + "\n";
}

const std::vector<std::string>& HelpFormatter::ExamplesOf(const CLI::App& verb) const {
  static const std::vector<std::string> none;
  const auto found = examples_.find(&verb);
  return found == examples_.end() ? none : found->second;
}

bool HelpFormatter::HasEveryday(const CLI::App& verb) const {
  return std::ranges::any_of(Flags(verb),
                             [&](const auto* flag) { return everyday_.contains(flag); });
}

std::string HelpFormatter::make_help(const CLI::App* app, std::string name,
                                     CLI::AppFormatMode mode) const {
  const bool is_whole = mode == CLI::AppFormatMode::All, is_top = app->get_parent() == nullptr;
  std::string text = app->get_description() + ".\n\n" + Usage(*app, name) + VerbsOf(*app);
  std::string positionals;
  for (const CLI::Option* option : app->get_options()) {
    if (option->get_positional()) {
      positionals += Row(NameAndType(*option), option->get_description());
    }
  }
  if (!positionals.empty()) text += "\n" + positionals;
  const bool shows_all = is_whole || !HasEveryday(*app);
  for (const std::string& group : app->get_groups()) {
    if (group == kEverywhere) continue;
    std::string rows;
    for (const CLI::Option* option : Flags(*app)) {
      const bool is_help = option == app->get_help_ptr() || option == app->get_help_all_ptr();
      if (is_help || option->get_group() != group) continue;
      if (!shows_all && !option->get_required() && !everyday_.contains(option)) continue;
      rows += Row(NameAndType(*option),
                  is_whole ? Explained(*option) : Brief(option->get_description()));
    }
    if (!rows.empty()) text += "\n" + (group == "Options" ? "" : group + ":\n") + rows;
  }
  if (is_top && is_whole) text += EverywhereOf(*app);
  if (!ExamplesOf(*app).empty()) {
    text += "\nExamples:\n";
    for (const std::string& line : ExamplesOf(*app)) text += "  " + line + "\n";
  }
  if (is_top) return text + "\n" + app->get_footer() + "\n";
  return text + "\n" +
         (is_whole ? "`retint --help` lists the options that every command takes."
                   : "`" + name + " --help` lists more options, `retint options` all of them.") +
         "\n";
}

}  // namespace retint::cli
