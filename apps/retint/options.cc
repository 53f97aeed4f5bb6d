// SPDX-License-Identifier: BSD-3-Clause
// retint options: the options of --set, job files and Python.
#include <algorithm>

#include <fmt/format.h>

#include "base/edit_distance.h"
#include "base/error.h"
#include "recolor/finer_gaussians.h"
#include "retint/common.h"
#include "retint/help.h"

namespace retint::cli {
namespace {

std::string GroupedName(const Option& option) {
  return (option.applies.empty() ? "" : option.applies + ".") + option.name;
}

void PrintList(const std::vector<StageOption>& all, const Run& run) {
  std::string stage;
  for (const StageOption& one : all) {
    if (one.stage != stage) run.PrintText((stage.empty() ? "" : "\n") + one.stage + ":\n");
    stage = one.stage;
    run.PrintText(
        Row(GroupedName(one.option), HelpOf(one.option) + " (default " + one.option.Text() + ")"));
  }
  run.PrintText(
      "\n`--set NAME=VALUE` sets one, also by its last word alone, such as ridge_rest=1e-2.\n"
      "`retint options NAME` explains it.\n");
}

std::string ValuesOf(const Option& option) {
  if (std::holds_alternative<bool*>(option.member)) return "true or false";
  const auto* choice = std::get_if<OptionChoice>(&option.member);
  if (!choice) return option.range.Text() + (option.unit.empty() ? "" : ", " + option.unit);
  std::string names;
  for (const std::string& name : choice->names) names += (names.empty() ? "" : ", ") + name;
  return names;
}

// `preset`: the same option of ReCoGS as published; null where it has none.
void Explain(const StageOption& one, const Option* preset, const Run& run) {
  const Option& option = one.option;
  run.PrintText(one.FullName() + "\n" + Row("what it does", HelpOf(option)) +
                Row("values", ValuesOf(option)) + Row("default", option.Text()));
  if (preset && preset->Text() != option.Text()) {
    run.PrintText(Row("--preset paper", preset->Text()));
  }
  if (!option.applies.empty()) run.PrintText(Row("only with", option.applies));
  const std::string flag = option.Flag();
  run.PrintText(
      Row("on the command line", flag.empty() ? "--set " + GroupedName(option) + "=" + option.Text()
                                              : flag + " " + option.Text()));
}

void ListOptions(const std::vector<std::string>& names, const Run& run) {
  EditOptions edit, paper = PresetOptions("paper");
  RefineOptions refine;
  const std::vector<StageOption> all = StagesOf(edit, refine);
  const OptionList preset = Described(paper);
  if (names.empty()) return PrintList(all, run);
  for (const std::string& name : names) {
    bool any = false;
    for (const StageOption& one : all) {
      if (!one.IsNamed(name) && name != one.stage) continue;
      if (any) run.PrintText("\n");
      Explain(one, FindOption(preset, one.option.name, one.option.applies), run);
      any = true;
    }
    CheckOption(any, "there is no option '" + name + "'; `retint options` lists them");
  }
}

}  // namespace

void AddOptions(CLI::App& app, Globals& globals, Action& action) {
  auto names = std::make_shared<std::vector<std::string>>();
  CLI::App* verb = AddVerb(app, globals, "options",
                           "List or explain the options that --set, job files and Python take");
  verb->add_option("NAME", *names, "Options to explain, or a stage such as refit");
  AddExamples(verb, {"retint options", "retint options ridge_rest", "retint options refit"});
  verb->callback([&action, names] { action = [names](Run& run) { ListOptions(*names, run); }; });
}

}  // namespace retint::cli
