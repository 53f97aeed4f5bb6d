// SPDX-License-Identifier: BSD-3-Clause
// retint recolor: the whole pipeline, painted views to a recolored splat. Flags become a recipe
// (pipeline/edit_recipe.h), which EditRun carries out.
#include <fmt/format.h>

#include "base/error.h"
#include "base/ranks.h"
#include "base/run_clock.h"
#include "pipeline/edit_run.h"
#include "retint/common.h"
#include "retint/results.h"
#include "retint/stage_plans.h"
#include "selecting/paint_held.h"

namespace retint::cli {
namespace {

struct Arguments {
  SceneArguments scene;
  EditArguments edit;
  PaintArguments paint;
  ColorArguments color;
  LargeArguments large;
  bool refine_gaussians = false;
  RefineOptions refine;
  OptionFlags refine_flags;
  std::filesystem::path cache;
  EditOutputs outputs;
  std::filesystem::path output;
};

EditRecipe RecipeOf(const Arguments& arguments, Run& run) {
  EditRecipe recipe;
  recipe.title = "Recoloring of " + arguments.scene.splat.filename().string();
  recipe.command = run.globals().command;
  recipe.workspace = arguments.scene.workspace;
  recipe.splat = arguments.scene.splat;
  recipe.holdout = arguments.color.holdout;
  recipe.options = Resolve(arguments.edit, run.globals());
  RefitOptions& refit = recipe.options.refit.options;
  refit.SetRegionCacheBytes(arguments.large.Limits(run).Cache(refit.RegionCacheBytes()));
  recipe.outputs = arguments.outputs;
  recipe.outputs.splats = {arguments.output};
  RegionRecipe region;
  region.name = "selection";
  region.paint = arguments.paint.Files();
  region.options = recipe.options;
  region.edit = arguments.color.flags.Resolve(run);
  region.strength = arguments.color.flags.strength();
  if (arguments.refine_gaussians) region.refine = arguments.refine;
  const bool has_pictures = std::ranges::any_of(
      region.edit.operations, [](const auto& op) { return op.picture != nullptr; });
  CheckOption(!region.paint.empty() || has_pictures,
              "--view and --mask are required, or --edited, whose pictures show what is meant");
  if (!recipe.outputs.comparison.empty()) CheckPicture(recipe.outputs.comparison);
  recipe.regions.push_back(std::move(region));
  return recipe;
}

void PrintResult(EditRun& edit, const EditRecipe& recipe, const Run& run) {
  EditSession& session = edit.session();
  const RunReport& report = edit.report();
  for (const PaintedReport& view : report.painted) {
    run.Print(fmt::format("{:<12} {} {:.1f} % measured, {} of {} points kept; {}", view.view,
                          view.depth_method, 100 * view.valid_fraction, view.cloud.kept,
                          view.cloud.sampled, view.registration.BriefReport()));
  }
  const Region& region = session.store().regions().regions.front();
  run.Print(fmt::format("selection    {}, {:.2f} % of their pixels",
                        VerdictOfPaint(session.scene().workspace(), edit.outcomes()[0].painted,
                                       region.selection->masks),
                        100 * report.mean_coverage));
  PrintEdit(region.edit, run);
  if (report.refine) run.Print("refine       " + report.refine->BriefReport());
  run.Print(fmt::format("refit        {}", report.refit.BriefReport()));
  PrintQuality(report.quality, run, &session);
  PrintOutOfGamut(region.edit, report.quality, run);
  PrintFormatError(edit.format_error(), run);
  PrintParts(report, run);
  run.Print(fmt::format("time         {:.1f} s, peak memory {:.0f} MB",
                        session.scene().clock().Total() / 1000, PeakRssMb()));
  PrintOutputs(recipe.outputs, run);
}

void Recolor(const Arguments& arguments, Run& run) {
  const EditRecipe recipe = RecipeOf(arguments, run);
  const auto scene = OpenSource(arguments.scene, arguments.large, recipe.holdout,
                                &recipe.options.refit.options, run);
  StageCache cache(arguments.cache);
  EditRun edit(recipe, *scene, cache,
               {.stage = {}, .warning = [&](const std::string& text) { run.Warn(text); }});
  run.SetPlan(PlanOf(recipe, edit.Plan()));
  edit.Run(run.monitor());
  // The line that is printed is not worth what the figures of a file are.
  const bool is_kept = !recipe.outputs.report.empty() || !recipe.outputs.page.empty();
  edit.Evaluate(is_kept ? EvaluationDetail() : EvaluationDetail{.most_views = 24, .row_step = 4},
                run.monitor());
  if (!run.Writes()) return;
  const ShareAmong alone;
  std::optional<PaintAdvice> advice;
  if (scene->IsWhole()) advice = AdviseOn(edit.session(), edit.outcomes()[0], run.monitor());
  edit.Write(run.warnings(), run.monitor());
  run.SetWritten();
  WarnOfLosses(arguments.output, edit.session().scene().original(), run);
  run.FinishProgress();
  PrintResult(edit, recipe, run);
  PrintAdvice(advice, run);
}

void AddRefineOptions(CLI::App* verb, Arguments& arguments) {
  const std::string group = "Refine";
  CLI::Option* const refine =
      verb->add_flag("--refine-gaussians", arguments.refine_gaussians,
                     "Before the fit, split large Gaussians that take paint of --edited, or of "
                     "other edits those inside the masks, as `retint refine` does; the output has "
                     "more Gaussians")
          ->group(group);
  OptionList list;
  arguments.refine.Describe(list);
  arguments.refine_flags.Add(verb, group, list);
  for (const Option& option : list) verb->get_option(option.flag)->needs(refine);
}

}  // namespace

void AddRecolor(CLI::App& app, Globals& globals, Action& action) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb =
      AddVerb(app, globals, "recolor", "The whole pipeline: painted views to a recolored splat");
  AddScene(verb, arguments->scene);
  AddPaint(verb, arguments->paint, /*required=*/false);
  AddPath(verb, "--output", arguments->output, "Splat to write, in the format of its extension")
      ->required();
  AddPath(verb, "--report", arguments->outputs.report, "Report to write (.json)");
  AddPath(verb, "--report-html", arguments->outputs.page,
          "Page (.html) to write: every view before, after and masked, plots, options");
  AddPath(verb, "--comparison", arguments->outputs.comparison,
          "Picture (.png) to write: before, mask and after of up to four views");
  AddPath(verb, "--save-stages", arguments->outputs.stages,
          "Folder for what every stage made: depth, clouds, registration, masks, targets, "
          "result",
          "FOLDER");
  AddPath(verb, "--cache", arguments->cache,
          "Folder in which each stage's result is kept, so that a run with other colors starts at "
          "the fit",
          "FOLDER");
  AddPreset(verb, arguments->edit);
  AddRefitOptions(verb, arguments->color, arguments->edit);
  AddDepthOptions(verb, arguments->edit, "--depth");
  AddCloudOptions(verb, arguments->edit);
  AddProjectorOptions(verb, arguments->edit);
  AddLarge(verb, arguments->large, /*selects=*/true);
  AddRefineOptions(verb, *arguments);
  verb->callback(
      [&action, arguments] { action = [arguments](Run& run) { Recolor(*arguments, run); }; });
}

}  // namespace retint::cli
