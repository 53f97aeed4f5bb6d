// SPDX-License-Identifier: BSD-3-Clause
// retint score: masks and recolored pictures against true masks.
#include "reporting/score.h"
#include "base/error.h"
#include "base/files.h"
#include "base/staged_output.h"
#include "retint/common.h"
#include "retint/help.h"

namespace retint::cli {
namespace {

struct Arguments {
  ScoreRequest request;
  EditFlags edit;
  std::filesystem::path cameras, report;
};

void ScoreFolders(const Arguments& arguments, Run& run) {
  ScoreRequest request = arguments.request;
  CheckOption(!request.after.empty() || !arguments.edit.Given(),
              "an edit is of pictures before and after it: it needs --before and --after");
  if (!request.after.empty()) {
    request.edit = arguments.edit.Resolve(run).WithStrength(arguments.edit.strength());
  }
  if (!arguments.report.empty()) CheckOutput(arguments.report);
  Workspace workspace;
  if (!arguments.cameras.empty()) {
    workspace = Workspace::Open(arguments.cameras);
    request.model = &workspace.reconstruction;
  }
  const ScoreReport report = Score(request, run.monitor());
  for (const std::string& warning : report.warnings) run.Warn(warning);
  StagedOutput staged;
  if (!arguments.report.empty()) {
    staged.Add(arguments.report, [&](const auto& path) { WriteFile(path, ToJson(report)); });
  }
  run.Commit(staged);
  run.FinishProgress();
  for (const std::string& line : ToLines(report)) run.Print(line);
}

}  // namespace

void AddScore(CLI::App& app, Globals& globals, Action& action) {
  auto arguments = std::make_shared<Arguments>();
  ScoreRequest& request = arguments->request;
  CLI::App* verb =
      AddVerb(app, globals, "score", "Measure masks or recolored pictures against true masks");
  AddPath(verb, "--truth", request.truth, "Folder of true masks, <image name>.png", "FOLDER")
      ->required();
  Everyday(verb, AddPath(verb, "--masks", request.masks,
                         "Folder of masks to measure, <image name>.png", "FOLDER"));
  Everyday(verb,
           AddPath(verb, "--before", request.before,
                   "Folder of pictures before the edit, as `retint render` writes them", "FOLDER"));
  CLI::Option* const after =
      Everyday(verb, AddPath(verb, "--after", request.after,
                             "Folder of the same pictures after the edit", "FOLDER"));
  Everyday(verb, AddRepeated(verb, "--painted", request.painted,
                             "Name of a painted view: listed, but in no mean; repeatable")
                     ->type_name("NAME"));
  CLI::Option* const cameras =
      AddPath(verb, "--cameras", arguments->cameras,
              "Workspace. With --painted, views that look in nearly the same direction have a mean "
              "of their own",
              "FOLDER");
  verb->add_option("--within", request.within_degrees,
                   "Largest angle between such directions, degrees")
      ->needs(cameras)
      ->check(CLI::Range(0.0, 180.0));
  verb->add_option("--border", request.border,
                   "Pixels inside the true border that count as neither hit nor missed")
      ->needs(after)
      ->check(CLI::Range(0, 1000));
  arguments->edit.Add(verb, "Edit to expect, with --after");
  Everyday(verb, AddPath(verb, "--report", arguments->report, "All figures to write (.json)"));
  AddExamples(verb, {"retint score --truth sample/truth/masks/box --masks masks"});
  verb->callback(
      [&action, arguments] { action = [arguments](Run& run) { ScoreFolders(*arguments, run); }; });
}

}  // namespace retint::cli
