// SPDX-License-Identifier: BSD-3-Clause
// retint recolor: the whole pipeline, painted views to a recolored splat. Flags become a recipe
// (pipeline/edit_recipe.h), which EditRun carries out.
#include <fstream>
#include <string>

#include <fmt/format.h>

#include "base/error.h"
#include "base/ranks.h"
#include "base/run_clock.h"
#include "pipeline/edit_checks.h"
#include "pipeline/edit_run.h"
#include "retint/common.h"
#include "retint/help.h"
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
  std::filesystem::path cache;
  EditOutputs outputs;
  std::string mask_names{kMaskNames[0]};
  std::filesystem::path output;
  CLI::Option* page_flag = nullptr;
  bool no_page = false;
  std::filesystem::path foreign_page;  // a file that is not Retint's, in the way of the page
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
  recipe.outputs.mask_names = MaskNamesOf(arguments.mask_names);
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
  CheckOption(region.refine || !arguments.edit.flags.Sets("refine"),
              "--set refine.pixels and its like require --refine");
  const std::filesystem::path& comparison = recipe.outputs.comparison;
  CheckOption(comparison.empty() || ExtensionOf(comparison) == ".png",
              comparison.string() + ": pictures are written as .png");
  recipe.regions.push_back(std::move(region));
  return recipe;
}

void PrintResult(EditRun& edit, const EditRecipe& recipe, const Run& run) {
  EditSession& session = edit.session();
  const Region& region = session.store().regions().regions.front();
  const std::string reach = VerdictOfPaint(
      session.scene().workspace(), region.selection->source.painted, region.selection->masks);
  if (run.globals().verbose) PrintDetails(edit, reach, run);
  PrintSummary(region.edit, edit.report(), reach, run);
  PrintOutOfGamut(region.edit, edit.report().quality, run);
  PrintOutputs(recipe.outputs, run);
}

void Recolor(const Arguments& arguments, Run& run) {
  const EditRecipe recipe = RecipeOf(arguments, run);
  CheckOutputs(recipe);
  if (!arguments.foreign_page.empty()) {
    run.Warn(arguments.foreign_page.string() +
             " is not a page of Retint and stays: no page is written. --report-html names another");
  }
  const auto scene = OpenSource(arguments.scene, arguments.large, recipe.holdout,
                                &recipe.options.refit.options, run);
  StageCache cache(arguments.cache);
  EditRun edit(recipe, *scene, cache,
               {.stage = {}, .warning = [&](const std::string& text) { run.Warn(text); }});
  std::vector<PlannedStage> plan = PlanOf(recipe, edit.Plan(), /*evaluates=*/true);
  plan.insert(plan.end() - 1, {"suggestion", 1});
  run.SetPlan(std::move(plan));
  edit.Run(run.monitor());
  // The printed line is not worth the time of a file's figures.
  const bool is_kept = !recipe.outputs.report.empty() || !recipe.outputs.page.empty();
  edit.Evaluate(is_kept ? EvaluationDetail() : EvaluationDetail{.most_views = 24, .row_step = 4},
                run.monitor());
  if (!run.Writes()) return;
  const ShareAmong alone;
  std::optional<PaintAdvice> advice;
  if (scene->IsWhole()) advice = AdviseOn(edit.session(), edit.outcomes()[0], run.monitor());
  edit.Write(run.warnings(), run.monitor());
  run.SetWritten();
  cache.Trim(kKeptStageBytes);
  WarnOfLosses(arguments.output, edit.session().scene().original(), run);
  run.FinishProgress();
  PrintResult(edit, recipe, run);
  PrintAdvice(advice, run);
}

void AddRefineOptions(CLI::App* verb, Arguments& arguments) {
  verb->add_flag("--refine", arguments.refine_gaussians,
                 "Split large Gaussians first, as `retint refine` does, so that fine paint stays "
                 "sharp. The output has more Gaussians")
      ->group("Fit");
  OptionList list;
  arguments.refine.Describe(list);
  arguments.edit.flags.Add(verb, "refine", kOtherOptions, list);
}

void AddOutputs(CLI::App* verb, Arguments& arguments) {
  Everyday(verb, AddPath(verb, "-o,--output", arguments.output,
                         "Splat to write, in the format of its extension")
                     ->required()
                     ->group(kOutputGroup));
  Everyday(verb, AddPath(verb, "--report", arguments.outputs.report, "Report to write (.json)")
                     ->group(kOutputGroup));
  arguments.page_flag =
      Everyday(verb, AddPath(verb, "--report-html", arguments.outputs.page,
                             "Page to write: every view before and after. Without it, the output's "
                             "name with .html")
                         ->group(kOutputGroup));
  Everyday(verb, verb->add_flag("--no-report-html", arguments.no_page, "Write no page")
                     ->excludes(arguments.page_flag)
                     ->group(kOutputGroup));
  Everyday(verb, AddPath(verb, "--comparison", arguments.outputs.comparison,
                         "Picture to write (.png): before, mask and after of up to four views")
                     ->group(kOutputGroup));
  AddPhotos(verb, arguments.outputs.photos, arguments.mask_names);
  AddPath(
      verb, "--save-stages", arguments.outputs.stages,
      "Folder for the results of all stages: depth, clouds, registration, paint, masks, targets, "
      "pictures",
      "FOLDER")
      ->group(kOutputGroup);
  AddPath(
      verb, "--cache", arguments.cache,
      "Folder to keep each stage's result in, so that a run with another color starts at the fit",
      "FOLDER")
      ->group(kOutputGroup);
}

// Whether a run of Retint wrote this page; its head says so.
bool IsOurs(const std::filesystem::path& page) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(page, ignored)) return false;
  constexpr size_t kHeadBytes = 64 << 10;
  std::string head(kHeadBytes, '\0');
  std::ifstream file(page, std::ios::binary);
  file.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<size_t>(file.gcount()));
  return head.find("<p>Retint ") != std::string::npos;
}

// The page goes beside the splat, unless a flag says otherwise. It replaces an earlier page of
// Retint, and no other file.
void NamePage(Arguments& arguments) {
  if (arguments.no_page || !arguments.outputs.page.empty()) return;
  std::filesystem::path page = arguments.output;
  page.replace_extension(".html");
  if (page == arguments.output) return;  // no splat is written as .html: --output is refused
  std::error_code ignored;
  if (std::filesystem::exists(page, ignored) && !IsOurs(page)) {
    arguments.foreign_page = page;
    return;
  }
  arguments.outputs.page = page;
  arguments.page_flag->add_result(arguments.outputs.page.string());  // for the checks of files
}

}  // namespace

void AddRecolor(CLI::App& app, Globals& globals, Action& action) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb = AddVerb(app, globals, "recolor",
                           "Recolor an object: painted views in, a recolored splat out");
  AddScene(verb, globals, arguments->scene);
  Everyday(verb, verb->get_option("--splat"));
  AddPaint(verb, arguments->paint, /*required=*/false);
  AddRefitOptions(verb, arguments->color, arguments->edit);
  AddOutputs(verb, *arguments);
  AddDepthOptions(verb, arguments->edit);
  AddCloudOptions(verb, arguments->edit);
  AddProjectorOptions(verb, arguments->edit);
  AddRefineOptions(verb, *arguments);
  AddLarge(verb, arguments->large, /*selects=*/true);
  AddPreset(verb, arguments->edit);
  AddExamples(verb,
              {"retint synth -o sample",
               "retint recolor sample --view 023.png --mask sample/masks/023.png.png --to teal "
               "-o teal.ply",
               "retint recolor sample --view 023.png --mask sample/masks/023.png.png --adjust "
               "hue=120 -o hue.spz"});
  verb->callback([&action, arguments] {
    NamePage(*arguments);
    action = [arguments](Run& run) { Recolor(*arguments, run); };
  });
}

}  // namespace retint::cli
