// SPDX-License-Identifier: BSD-3-Clause
#include "retint/manual.h"

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "base/run_clock.h"

namespace retint::cli {
namespace {

// The options of all verbs have a place of their own in the page.
constexpr const char* kEverywhere = "Everywhere";

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

// As help has them: the names, then type, default and whether it must be given.
std::string OptionsPage(const CLI::App& app, const std::string& group) {
  const auto* format = dynamic_cast<const CLI::Formatter*>(app.get_formatter().get());
  std::string page;
  for (const CLI::Option* option : app.get_options()) {
    if (!format || option->get_group() != group) continue;
    const bool positional = option->get_positional();
    page += ".TP\n\\fB" + Roff(format->make_option_name(option, positional)) + "\\fR" +
            Roff(format->make_option_opts(option)) + "\n" + Roff(format->make_option_desc(option)) +
            "\n";
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
                     ".SS Everywhere\nEvery verb takes these.\n" +
                     OptionsPage(*verbs.front(), kEverywhere) + ".SH VERBS\n";
  for (const CLI::App* verb : verbs) page += VerbPage(*verb);
  return page + ".SH EXIT STATUS\n" + Roff(app.get_footer()) + "\n";
}

// ---- bash ----

std::vector<std::string> FlagsOf(const CLI::App& app) {
  std::vector<std::string> flags;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) flags.push_back("--" + name);
  }
  return flags;
}

std::string Joined(const std::vector<std::string>& words, const char* separator) {
  std::string joined;
  for (const std::string& word : words) joined += (joined.empty() ? "" : separator) + word;
  return joined;
}

// The words of "TEXT:{auto,cpu,cuda}"; empty for any other type.
std::string ChoicesOf(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const size_t open = type.find('{'), close = type.find('}');
  if (open == std::string::npos || close == std::string::npos) return "";
  std::string words = type.substr(open + 1, close - open - 1);
  std::replace(words.begin(), words.end(), ',', ' ');
  return words;
}

// A branch for each option of a verb whose value is one of several words, or a folder.
std::string ValueCases(const CLI::App& verb) {
  std::string cases;
  for (const CLI::Option* option : verb.get_options()) {
    if (option->get_lnames().empty() || option->get_items_expected_max() == 0) continue;
    const std::string words = ChoicesOf(*option);
    const bool folder = option->get_type_name() == "FOLDER";
    std::string reply = "return";
    if (!words.empty()) reply = "_retint_words '" + words + "'; return";
    if (folder) reply = "mapfile -t COMPREPLY < <(compgen -d -- \"$current\"); return";
    cases +=
        "    '" + verb.get_name() + " --" + option->get_lnames().front() + "') " + reply + " ;;\n";
  }
  return cases;
}

std::string BashCompletion(const CLI::App& app) {
  std::vector<std::string> names;
  std::string flags, values;
  for (const CLI::App* verb : Verbs(app)) {
    names.push_back(verb->get_name());
    flags +=
        "    " + verb->get_name() + ") _retint_words '" + Joined(FlagsOf(*verb), " ") + "' ;;\n";
    values += ValueCases(*verb);
  }
  return "# Completion of retint for bash; made by `retint manual bash`.\n"
         "_retint_words() { mapfile -t COMPREPLY < <(compgen -W \"$1\" -- \"$current\"); }\n"
         "_retint() {\n"
         "  local current=${COMP_WORDS[COMP_CWORD]} verb='' word\n"
         "  for word in \"${COMP_WORDS[@]:1:COMP_CWORD-1}\"; do\n"
         "    case $word in " +
         Joined(names, " | ") +
         ") verb=$word; break ;; esac\n"
         "  done\n"
         "  case \"$verb ${COMP_WORDS[COMP_CWORD-1]}\" in\n" +
         values +
         "  esac\n"
         "  if [[ -n $verb && $current != -* ]]; then return; fi\n"
         "  case $verb in\n"
         "    '') _retint_words '" +
         Joined(names, " ") + " " + Joined(FlagsOf(app), " ") + "' ;;\n" + flags +
         "  esac\n"
         "}\n"
         "complete -o default -F _retint retint\n";
}

}  // namespace

void AddManual(CLI::App& app) {
  CLI::App* verb = app.add_subcommand("manual", "Print the man page or the completion of bash");
  verb->group("");
  auto format = std::make_shared<std::string>();
  verb->add_option("format", *format, "man or bash")
      ->required()
      ->check(CLI::IsMember({"man", "bash"}));
  verb->callback([&app, format] {
    const std::string text = *format == "man" ? ManPage(app) : BashCompletion(app);
    std::fwrite(text.data(), 1, text.size(), stdout);
    throw CLI::Success();
  });
}

}  // namespace retint::cli
