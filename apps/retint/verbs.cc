// SPDX-License-Identifier: BSD-3-Clause
#include "retint/verbs.h"

namespace retint::cli {

// Each in the file of its name.
void AddRecolor(CLI::App& app, Globals& globals, Action& action);
void AddMask(CLI::App& app, Globals& globals, Action& action);
void AddInfo(CLI::App& app, Globals& globals, Action& action);
void AddRun(CLI::App& app, Globals& globals, Action& action);
void AddRender(CLI::App& app, Globals& globals, Action& action);
void AddSuggest(CLI::App& app, Globals& globals, Action& action);
void AddPalette(CLI::App& app, Globals& globals, Action& action);
void AddSelect(CLI::App& app, Globals& globals, Action& action);
void AddProject(CLI::App& app, Globals& globals, Action& action);
void AddRefit(CLI::App& app, Globals& globals, Action& action);
void AddRefine(CLI::App& app, Globals& globals, Action& action);
void AddDepth(CLI::App& app, Globals& globals, Action& action);
void AddSynth(CLI::App& app, Globals& globals, Action& action);
void AddAlign(CLI::App& app, Globals& globals, Action& action);
void AddMatch(CLI::App& app, Globals& globals, Action& action);
void AddCameras(CLI::App& app, Globals& globals, Action& action);
void AddConvert(CLI::App& app, Globals& globals, Action& action);
void AddIndex(CLI::App& app, Globals& globals, Action& action);
void AddEvaluate(CLI::App& app, Globals& globals, Action& action);
void AddScore(CLI::App& app, Globals& globals, Action& action);
void AddOptions(CLI::App& app, Globals& globals, Action& action);

const std::vector<VerbGroup>& VerbGroups() {
  static const std::vector<VerbGroup> groups = {
      {"Start here", {AddRecolor, AddMask, AddInfo, AddRun}},
      {"Look", {AddRender, AddSuggest, AddPalette}},
      {"Stages of recolor", {AddSelect, AddProject, AddRefit, AddRefine, AddDepth}},
      {"Scenes", {AddSynth, AddAlign, AddMatch, AddCameras, AddConvert, AddIndex}},
      {"Measure", {AddEvaluate, AddScore}},
      {"Help", {AddOptions}}};
  return groups;
}

}  // namespace retint::cli
