// SPDX-License-Identifier: BSD-3-Clause
// retint suggest: which view to paint next.
#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/files.h"
#include "base/staged_output.h"
#include "retint/common.h"
#include "retint/help.h"
#include "selection/suggestion.h"

namespace retint::cli {
namespace {

struct Arguments {
  SceneArguments scene;
  EditArguments edit;
  PaintArguments paint;
  std::filesystem::path report;
  int count = 5;
};

std::string ToJson(const std::vector<ViewSuggestion>& suggestions) {
  nlohmann::ordered_json views = nlohmann::ordered_json::array();
  for (const ViewSuggestion& one : suggestions) {
    views.push_back({{"view", one.view}, {"settles", one.settles}, {"fraction", one.fraction}});
  }
  return nlohmann::ordered_json({{"views", views}})
             .dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) +
         "\n";
}

void Suggest(const Arguments& arguments, Run& run) {
  const EditOptions options = Resolve(arguments.edit, run.globals());
  CheckOption(options.projector.Completes(),
              "a suggestion needs a completed selection: --completion near or all, and --set "
              "projector=gaussians");
  if (!arguments.report.empty()) CheckOutput(arguments.report);
  const auto session = OpenSession(arguments.scene, 0, run);
  SelectionSource source;
  source.painted = ReadPaint(arguments.paint, session->scene().pictures());
  source.select = options.select;
  source.projector = options.projector;
  session->selection().Select(source, run.monitor());
  const ProjectedMasks masks = session->selection().Project(source, run.monitor());
  std::vector<std::string> names;
  for (const PaintedView& view : source.painted) names.push_back(view.name);
  const auto suggestions =
      SuggestViews(session->scene().renderer(), session->scene().reconstruction(),
                   session->scene().pictures().Groups(), names, masks.confidence, masks.visible,
                   arguments.count, run.monitor());
  StagedOutput staged;
  if (!arguments.report.empty()) {
    staged.Add(arguments.report, [&](const auto& path) { WriteFile(path, ToJson(suggestions)); });
  }
  run.Commit(staged);
  run.FinishProgress();
  if (!SettlesAnything(suggestions)) {
    run.Print(
        "no view would settle anything: the paint shows the whole object, or covers too few "
        "Gaussians to complete the selection from them");
    return;
  }
  const size_t shown = std::min(suggestions.size(), static_cast<size_t>(arguments.count));
  for (size_t i = 0; i < shown; ++i) {
    run.Print(fmt::format("{:<3} {:<32} settles {:5.1f} % of what is uncertain", i + 1,
                          suggestions[i].view, 100 * suggestions[i].fraction));
  }
}

}  // namespace

void AddSuggest(CLI::App& app, Globals& globals, Action& action) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb = AddVerb(app, globals, "suggest", "Name the views to paint next");
  AddScene(verb, globals, arguments->scene);
  AddPaint(verb, arguments->paint, /*required=*/true);
  Everyday(verb, verb->add_option("--count", arguments->count,
                                  "Views to name; each assumes that you painted those before it")
                     ->check(CLI::Range(1, 1000)));
  Everyday(verb, AddPath(verb, "--report", arguments->report,
                         "All views in their order to write (.json)"));
  AddPreset(verb, arguments->edit);
  AddDepthOptions(verb, arguments->edit);
  AddCloudOptions(verb, arguments->edit);
  AddProjectorOptions(verb, arguments->edit);
  AddExamples(verb,
              {"retint suggest sample --view 023.png --mask sample/masks/023.png.png --count 3"});
  verb->callback(
      [&action, arguments] { action = [arguments](Run& run) { Suggest(*arguments, run); }; });
}

}  // namespace retint::cli
