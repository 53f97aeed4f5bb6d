// SPDX-License-Identifier: BSD-3-Clause
// retint match: the colors of a splat brought to its photos', or to another splat's.
#include <fmt/format.h>

#include "base/error.h"
#include "base/files.h"
#include "base/staged_output.h"
#include "editing/match_scene.h"
#include "reporting/export.h"
#include "reporting/match_report.h"
#include "reporting/report_html.h"
#include "retint/common.h"
#include "retint/help.h"
#include "retint/results.h"
#include "splat_io/splat_io.h"
#include "splat_io/streamed_sog.h"

namespace retint::cli {
namespace {

struct Arguments {
  SceneArguments scene;
  MatchRecipe match;
  std::filesystem::path output, report, page;
  int holdout = 4;
};

void Match(const Arguments& arguments, Run& run) {
  arguments.match.Check();
  CodecForWriting(arguments.output);
  for (const auto& path : {arguments.output, arguments.report, arguments.page}) {
    if (!path.empty()) CheckOutput(path);
  }
  const auto session = OpenSession(arguments.scene, arguments.holdout, run);
  CheckStreamedSog(arguments.output, session->scene().original());
  const SceneMatch match = MatchByRecipe(*session, arguments.match, run.monitor());
  if (!match.warning.empty()) run.Warn(match.warning);
  ApplyMatch(*session, match.colors, "match", run.monitor());
  session->refits().Refit({}, run.monitor());
  StagedOutput staged;
  staged.Add(arguments.output, [&](const auto& path) { session->WriteSplat(path, run.monitor()); });
  if (!arguments.report.empty()) {
    staged.Add(arguments.report, [&](const auto& path) { WriteFile(path, ToJson(match)); });
  }
  if (!arguments.page.empty()) {
    HtmlReportOptions options;
    options.title = "Colors of " + arguments.scene.splat.filename().string() + " matched";
    options.command = run.globals().command;
    options.warnings = run.warnings();
    options.content = PageOf(match);
    staged.Add(arguments.page, [&](const auto& path) {
      WriteFile(path, HtmlReport(*session, MakeReport(*session), options, run.monitor()));
    });
  }
  run.Commit(staged);
  WarnOfLosses(arguments.output, session->scene().original(), run);
  run.FinishProgress();
  for (const std::string& line : LinesOf(match)) run.Print(line);
  for (const auto& path : {arguments.page, arguments.output, arguments.report}) {
    if (!path.empty()) run.Print(fmt::format("wrote        {}", path.string()));
  }
}

}  // namespace

void AddMatch(CLI::App& app, Globals& globals, Action& action) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb = AddVerb(app, globals, "match",
                           "Bring the colors of a splat to its photos', or to another splat's");
  AddScene(verb, globals, arguments->scene);
  Everyday(verb, verb->get_option("--splat"));
  AddPath(verb, "-o,--output", arguments->output, "Splat to write, in the format of its extension")
      ->required();
  CLI::Option* const like =
      Everyday(verb, AddPath(verb, "--like", arguments->match.like,
                             "Another splat of the same place and frame, such as `retint align` "
                             "writes: match its colors instead of the photos'"));
  Everyday(verb, verb->add_option("--gray", arguments->match.gray,
                                  "Gray card in the photo of a view, in its pixels, or its four "
                                  "corners: it becomes neutral")
                     ->type_name("VIEW:X,Y,W,H")
                     ->excludes(like)
                     ->default_str(""));
  Everyday(verb, verb->add_option("--checker", arguments->match.checker,
                                  "ColorChecker of 24 patches in the photo of a view, or its four "
                                  "corners: its patches get their published colors")
                     ->type_name("VIEW:X,Y,W,H")
                     ->excludes(like)
                     ->excludes(verb->get_option("--gray"))
                     ->default_str(""));
  Everyday(verb, verb->add_option("--map", arguments->match.map,
                                  "Kind of the map: one exposure, a white balance, a matrix, a "
                                  "matrix and a smooth table, or the plainest that held-out views "
                                  "do not show to be worse")
                     ->check(CLI::IsMember({"auto", "exposure", "balance", "matrix", "table"})));
  verb->add_option("--holdout", arguments->holdout,
                   "Hold out every N-th view by name, to choose and to measure the map")
      ->check(CLI::Range(2, 1000000));
  Everyday(verb, AddPath(verb, "--report", arguments->report, "Report to write (.json)"));
  Everyday(verb, AddPath(verb, "--report-html", arguments->page,
                         "Page to write: every view before and after"));
  AddExamples(verb, {"retint match sample -o matched.ply --report-html matched.html"});
  verb->callback(
      [&action, arguments] { action = [arguments](Run& run) { Match(*arguments, run); }; });
}

}  // namespace retint::cli
