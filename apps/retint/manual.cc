// SPDX-License-Identifier: BSD-3-Clause
#include "retint/manual.h"

#include <algorithm>
#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "base/run_clock.h"
#include "recolor/color_name.h"
#include "retint/common.h"
#include "retint/help.h"

namespace retint::cli {
namespace {

std::vector<const CLI::App*> Verbs(const CLI::App& app) {
  std::vector<const CLI::App*> verbs;
  for (const CLI::App* verb : app.get_subcommands(std::function<bool(const CLI::App*)>{})) {
    if (!verb->get_group().empty()) verbs.push_back(verb);
  }
  return verbs;
}

// ---- roff ----

// Text that roff shows as it is: no escapes, no commands, hyphens that stay hyphens.
std::string Roff(std::string_view text) {
  std::string out;
  bool start = true;
  for (const char c : text) {
    if (start && (c == '.' || c == '\'')) out += "\\&";
    start = c == '\n';
    if (c == '\\') {
      out += "\\e";
    } else if (c == '-') {
      out += "\\-";
    } else if (c == '\'') {
      out += "\\(aq";
    } else if (c == '`') {
      out += "\\(ga";
    } else {
      out += c;
    }
  }
  return out;
}

std::string OptionsPage(const CLI::App& app, const std::string& group) {
  std::string page;
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_group() != group) continue;
    page += ".TP\n\\fB" + Roff(NameAndType(*option)) + "\\fR\n" + Roff(Explained(*option)) + "\n";
  }
  return page;
}

std::string VerbPage(const CLI::App& verb) {
  std::string page =
      ".SS retint " + Roff(verb.get_name()) + "\n" + Roff(verb.get_description()) + ".\n";
  for (const std::string& group : verb.get_groups()) {
    if (group == kEverywhere || group.empty()) continue;
    const std::string options = OptionsPage(verb, group);
    if (!options.empty()) page += ".PP\n\\fI" + Roff(group) + "\\fR\n" + options;
  }
  return page;
}

std::string ManPage(const CLI::App& app) {
  const std::vector<const CLI::App*> verbs = Verbs(app);
  std::string page = ".TH RETINT 1 \"\" \"retint " + std::string(Version()) +
                     "\" \"User Commands\"\n.SH NAME\nretint \\- recolor regions of 3D Gaussian "
                     "Splatting scenes\n.SH SYNOPSIS\n\\fBretint\\fR \\fIVERB\\fR "
                     "[\\fIOPTION\\fR]...\n.SH DESCRIPTION\n" +
                     Roff(app.get_description()) + "\n.SH OPTIONS\n" + OptionsPage(app, "Options") +
                     ".SS Every command\n" + OptionsPage(*verbs.front(), kEverywhere) +
                     ".SH VERBS\n";
  for (const CLI::App* verb : verbs) page += VerbPage(*verb);
  return page + ".SH EXIT STATUS\n" + Roff(app.get_footer()) + "\n";
}

// ---- completion ----

std::string Joined(const std::vector<std::string>& words, const char* separator) {
  std::string joined;
  for (const std::string& word : words) joined += (joined.empty() ? "" : separator) + word;
  return joined;
}

// "-o", "--output"
std::vector<std::string> NamesOf(const CLI::Option& option) {
  std::vector<std::string> names;
  for (const std::string& name : option.get_snames()) names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
  return names;
}

// The options of --set, and the words that each may be; none: a number.
std::map<std::string, std::vector<std::string>> SetValues() {
  EditOptions edit;
  RefineOptions refine;
  std::map<std::string, std::vector<std::string>> values;
  for (const StageOption& one : StagesOf(edit, refine)) {
    std::vector<std::string>& words = values[one.option.name];
    if (std::holds_alternative<bool*>(one.option.member)) words = {"true", "false"};
    const auto* choice = std::get_if<OptionChoice>(&one.option.member);
    if (choice) words = choice->names;
  }
  return values;
}

// "    solver) COMMAND 'mm adam' ;;", a line for each option of --set with words.
std::string SetCases(const char* before, const char* after) {
  std::string cases;
  for (const auto& [name, words] : SetValues()) {
    if (words.empty()) continue;
    cases += "    " + name + ") " + before + Joined(words, " ") + after + " ;;\n";
  }
  return cases;
}

// Words that the value of an option may be; "ridge_rest=" goes on.
std::vector<std::string> ValuesOf(const CLI::Option& option) {
  std::vector<std::string> words = ChoicesOf(option);
  if (option.get_name() == "--to" || option.get_name() == "--tint") {
    for (const std::string_view name : ColorNames()) words.emplace_back(name);
  }
  if (option.get_name() == "--set") {
    for (const auto& [name, values] : SetValues()) words.push_back(name + "=");
  }
  return words;
}

bool TakesValue(const CLI::Option& option) { return option.get_items_expected_max() > 0; }
bool IsFolder(const CLI::Option& option) { return option.get_type_name() == "FOLDER"; }
bool IsFile(const CLI::Option& option) {
  return option.get_type_name().find("FILE") != std::string::npos;
}

std::vector<std::string> FlagNames(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* option : Flags(app)) {
    for (const std::string& name : NamesOf(*option)) names.push_back(name);
  }
  return names;
}

// A branch for each option of a verb whose value is one of several words, or a folder.
std::string BashValues(const CLI::App& verb) {
  std::string cases;
  for (const CLI::Option* option : Flags(verb)) {
    if (!TakesValue(*option)) continue;
    const std::vector<std::string> words = ValuesOf(*option);
    std::string reply = "return";
    if (!words.empty()) reply = "_retint_words '" + Joined(words, " ") + "'; return";
    if (option->get_name() == "--set") reply = "compopt -o nospace 2>/dev/null || true; " + reply;
    if (IsFolder(*option)) reply = "_retint_folders; return";
    std::vector<std::string> patterns;
    for (const std::string& name : NamesOf(*option)) {
      patterns.push_back("'" + verb.get_name() + " " + name + "'");
    }
    cases += "    " + Joined(patterns, " | ") + ") " + reply + " ;;\n";
  }
  return cases;
}

std::string BashCompletion(const CLI::App& app) {
  std::vector<std::string> names;
  std::string flags, values;
  for (const CLI::App* verb : Verbs(app)) {
    names.push_back(verb->get_name());
    flags +=
        "    " + verb->get_name() + ") _retint_words '" + Joined(FlagNames(*verb), " ") + "' ;;\n";
    values += BashValues(*verb);
  }
  return "# Completion of retint for bash; made by `retint manual bash`.\n"
         "_retint_words() { mapfile -t COMPREPLY < <(compgen -W \"$1\" -- \"$current\"); }\n"
         "_retint_folders() {\n"
         "  compopt -o filenames 2>/dev/null || true\n"
         "  mapfile -t COMPREPLY < <(compgen -d -- \"$current\")\n"
         "}\n"
         "# The value of --set NAME=VALUE, which Bash splits at the sign.\n"
         "_retint_set() {\n"
         "  case ${1##*.} in\n" +
         SetCases("_retint_words '", "'") +
         "  esac\n"
         "}\n"
         "_retint() {\n"
         "  local current=${COMP_WORDS[COMP_CWORD]} verb='' word\n"
         "  for word in \"${COMP_WORDS[@]:1:COMP_CWORD-1}\"; do\n"
         "    case $word in " +
         Joined(names, " | ") +
         ") verb=$word; break ;; esac\n"
         "  done\n"
         "  local sign=$COMP_CWORD\n"
         "  [[ $current == = ]] && current='' || sign=$((COMP_CWORD - 1))\n"
         "  if ((sign > 2)) && [[ ${COMP_WORDS[sign]} == = && ${COMP_WORDS[sign-2]} == --set ]]; "
         "then\n"
         "    _retint_set \"${COMP_WORDS[sign-1]}\"\n"
         "    return\n"
         "  fi\n"
         "  case \"$verb ${COMP_WORDS[COMP_CWORD-1]}\" in\n" +
         values +
         "  esac\n"
         "  if [[ -n $verb && $current != -* ]]; then return; fi\n"
         "  case $verb in\n"
         "    '') _retint_words '" +
         Joined(names, " ") + " " + Joined(FlagNames(app), " ") + "' ;;\n" + flags +
         "  esac\n"
         "}\n"
         "complete -o default -F _retint retint\n";
}

// `text` with a backslash before each character of `special`.
std::string Escaped(std::string_view text, std::string_view special) {
  std::string out;
  for (const char c : text) {
    if (special.find(c) != std::string_view::npos) out += '\\';
    out += c;
  }
  return out;
}

// In single quotes, of a text that may have some.
std::string Quoted(std::string_view text) {
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

// "'*--to[Make the region ...]:value:(red green)'"
std::string ZshFlags(const CLI::App& app) {
  std::string lines;
  for (const CLI::Option* option : Flags(app)) {
    std::string value;
    if (TakesValue(*option)) {
      const std::vector<std::string> words = ValuesOf(*option);
      const bool is_set = option->get_name() == "--set";
      value = ":value:" + (is_set              ? std::string("_retint_set")
                           : !words.empty()    ? "(" + Joined(words, " ") + ")"
                           : IsFolder(*option) ? std::string("_files -/")
                           : IsFile(*option)   ? std::string("_files")
                                               : std::string(" "));
    }
    for (const std::string& name : NamesOf(*option)) {
      lines += " \\\n        " +
               Quoted("*" + name + "[" + Escaped(option->get_description(), "[]:\\") + "]" + value);
    }
  }
  return lines;
}

std::string ZshCompletion(const CLI::App& app) {
  std::string verbs, cases;
  std::vector<std::string> names;
  for (const auto& [name, values] : SetValues()) names.push_back(name + "=");
  for (const CLI::App* verb : Verbs(app)) {
    verbs += "    " + Quoted(verb->get_name() + ":" + Escaped(verb->get_description(), ":")) + "\n";
    cases += "    " + verb->get_name() + ")\n      _arguments" + ZshFlags(*verb) +
             " \\\n        '*:file:_files' ;;\n";
  }
  return "#compdef retint\n"
         "# Completion of retint for zsh; made by `retint manual zsh`.\n"
         "# NAME=VALUE of --set: no space after the sign, then the words of that option.\n"
         "_retint_set() {\n"
         "  if ! compset -P '*='; then\n"
         "    compadd -S '' -- " +
         Joined(names, " ") +
         "\n"
         "    return\n"
         "  fi\n"
         "  case ${${IPREFIX%=}##*.} in\n" +
         SetCases("compadd -- ", "") +
         "  esac\n"
         "}\n"
         "_retint() {\n"
         "  local -a verbs=(\n" +
         verbs +
         "  )\n"
         "  if (( CURRENT == 2 )); then\n"
         "    _describe command verbs\n"
         "    _arguments" +
         ZshFlags(app) +
         "\n"
         "    return\n"
         "  fi\n"
         "  shift words\n"
         "  (( CURRENT-- ))\n"
         "  case $words[1] in\n" +
         cases +
         "  esac\n"
         "}\n"
         "_retint \"$@\"\n";
}

std::string FishFlags(const CLI::App& app, const std::string& condition) {
  std::string lines;
  for (const CLI::Option* option : Flags(app)) {
    std::string line = "complete -c retint -n " + Quoted(condition);
    for (const std::string& name : option->get_snames()) line += " -s " + name;
    for (const std::string& name : option->get_lnames()) line += " -l " + name;
    if (TakesValue(*option)) {
      const std::vector<std::string> words = ValuesOf(*option);
      if (!words.empty()) {
        line += " -x -a " + Quoted(Joined(words, " "));
      } else if (IsFolder(*option)) {
        line += " -x -a '(__fish_complete_directories)'";
      } else {
        line += IsFile(*option) ? " -r" : " -x";
      }
    }
    lines += line + " -d " + Quoted(option->get_description()) + "\n";
  }
  return lines;
}

std::string FishCompletion(const CLI::App& app) {
  std::string text = "# Completion of retint for fish; made by `retint manual fish`.\n" +
                     FishFlags(app, "__fish_use_subcommand");
  for (const CLI::App* verb : Verbs(app)) {
    text += "complete -c retint -f -n '__fish_use_subcommand' -a " + verb->get_name() + " -d " +
            Quoted(verb->get_description()) + "\n" +
            FishFlags(*verb, "__fish_seen_subcommand_from " + verb->get_name());
  }
  return text;
}

}  // namespace

void AddManual(CLI::App& app) {
  CLI::App* verb = app.add_subcommand("manual", "Print the man page, or completion for a shell");
  verb->group("");
  auto format = std::make_shared<std::string>();
  verb->add_option("FORMAT", *format, "man, bash, zsh or fish")
      ->required()
      ->check(CLI::IsMember({"man", "bash", "zsh", "fish"}));
  verb->callback([&app, format] {
    const std::string text = *format == "man"    ? ManPage(app)
                             : *format == "bash" ? BashCompletion(app)
                             : *format == "zsh"  ? ZshCompletion(app)
                                                 : FishCompletion(app);
    std::fwrite(text.data(), 1, text.size(), stdout);
    throw CLI::Success();
  });
}

}  // namespace retint::cli
